"""Builds the documentation site: `python tools/build_site.py [--to FOLDER]`, or `make docs`.

The sources are the Markdown pages as they stand in the repository (links of theirs lead where they
lead on a Git host), and pages made from the code: gallery, keys, plug-ins, commands, API. Warnings
are errors; so are links of the site that lead nowhere, and what it asks of other hosts. Pictures of
the gallery are kept in `build/site/cache`.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from site_pages import commands, gallery, keys, plugins
from site_pages.links import asked_of_others, dead_links
from site_pages.pictures import Drawn, drawn

ROOT = Path(__file__).resolve().parent.parent
# Pages, and files that these link to.
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "CITATION.cff", "pyproject.toml")

INDEX = """\
```{include} README.md
```

```{toctree}
:hidden:
:caption: Start

docs/README
docs/tutorial
docs/coming-from-ros
docs/coming-from-ns-3
docs/coming-from-gazebo
docs/coming-from-irsim
reference/gallery
docs/commands
reference/commands
```

```{toctree}
:hidden:
:caption: Use

docs/scenarios
reference/keys
docs/maps
docs/robots
docs/network-models
docs/defaults
docs/testbed-traffic
docs/clocks
docs/networks-alone
docs/strategies
docs/envs
docs/map-sharing
docs/slam
docs/computers
docs/energy
docs/navigation
docs/results
docs/replay
docs/why
docs/export
MORE
docs/campaigns
docs/in-your-ci
docs/cluster
docs/reports
docs/validation
docs/performance
```

```{toctree}
:hidden:
:caption: Middleware
:glob:

docs/middleware
docs/middleware/*
```

```{toctree}
:hidden:
:caption: Plug-ins

reference/plugins/index
docs/writing-plugins
```

```{toctree}
:hidden:
:caption: Studies
:glob:

docs/studies/*
```

```{toctree}
:hidden:
:caption: Inside

reference/api
docs/architecture
docs/where-is
docs/decisions
docs/glossary
CONTRIBUTING
CHANGELOG
```

"""

API = """\
# The Python API

## desim

```{eval-rst}
.. autofunction:: desim.load
.. autofunction:: desim.from_mapping
.. autofunction:: desim.run
.. autoclass:: desim.Run
   :members:
.. autoclass:: desim.Campaign
   :members:
.. autofunction:: desim.compare
.. autoclass:: desim.results.comparison.ComparedRuns
   :members:
.. autoclass:: desim.campaign.folder.comparison.ComparedCampaigns
   :members:
```

## desim.ports

```{eval-rst}
.. automodule:: desim.ports
   :members:
   :imported-members:
```

## desim.testing

```{eval-rst}
.. automodule:: desim.testing
   :members:
   :imported-members:
   :exclude-members: Params
```
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--to", type=Path, help="copy the site there, too")
    arguments = parser.parse_args()
    work = ROOT / "build" / "site"
    source, site = work / "source", work / "html"
    for folder in source, site:  # pages of before may have links to what is gone
        shutil.rmtree(folder, ignore_errors=True)
    write_sources(source, {one.name: drawn(one, source / "reference" / "pictures",
                                           source / "extra" / "replays", work / "cache")
                           for one in gallery.chosen("desim run")})
    from sphinx.cmd.build import build_main

    code = build_main(["-q", "-E", "-a", "-W", "--keep-going", "-b", "html", "-c",
                       str(ROOT / "tools" / "site_pages"), "-d", str(work / "doctrees"),
                       str(source), str(site)])
    shutil.copytree(source / "extra" / "replays", site / "replays")
    faults = [f"{link}: leads nowhere" for link in dead_links(site)] + [
        f"{asked}: is on another host" for asked in asked_of_others(site)]
    for fault in faults:
        print(fault, file=sys.stderr)
    if arguments.to is not None:
        shutil.copytree(site, arguments.to, dirs_exist_ok=True)
    print((arguments.to or site) / "index.html")
    return code or int(bool(faults))


def write_sources(source: Path, pictures: dict[str, Drawn]) -> None:
    """Copy the pages to where they stand in the repository, and write those that are made from the
    code."""
    shutil.copytree(ROOT / "docs", source / "docs")
    for name in PAGES:
        shutil.copy2(ROOT / name, source)
    reference = source / "reference"
    known = {path.relative_to(ROOT).with_suffix("").as_posix()
             for path in (ROOT / "docs").glob("*.md")}
    more = sorted(page for page in known if page not in INDEX)
    pages = {"gallery.md": gallery.page(pictures, ROOT / "docs"),
             "keys.md": keys.page(), "commands.md": commands.page(), "api.md": API,
             **{f"plugins/{name}": text for name, text in plugins.pages().items()}}
    (source / "index.md").write_text(INDEX.replace("MORE", "\n".join(more)))
    for name, text in pages.items():
        (reference / name).parent.mkdir(parents=True, exist_ok=True)
        (reference / name).write_text(text)


if __name__ == "__main__":
    sys.exit(main())
