"""The documentation site: the pages that are made from the code name everything that is there."""

from __future__ import annotations

import re
import subprocess
import sys
from html import unescape
from urllib.parse import unquote

import build_site  # a tool
import pytest
from site_pages import commands, gallery, keys, text
from site_pages import plugins as plugin_pages
from site_pages.pictures import Drawn, drawn

from desim import plugins
from desim.cli import app
from desim.scenario import yaml12
from desim.scenario.shipped import shipped

_NAMED = ("network.media", "hosts", "fleet.types")


def written_keys(value, path=""):
    """The dotted keys of a resolved scenario, names and numbers as the page has them."""
    if isinstance(value, dict):
        for key, below in value.items():
            step = "NAME" if path in _NAMED else key
            yield from written_keys(below, f"{path}.{step}" if path else step)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for below in value:
            yield from written_keys(below, f"{path}.N")
    else:
        yield path


def dead_links(site):
    """The links from page to page that lead nowhere."""
    pages = {page.resolve(): page.read_text() for page in site.rglob("*.html")
             if "_downloads" not in page.parts}
    names = {page: set(re.findall(r'\bid="([^"]+)"', html)) for page, html in pages.items()}
    found = []
    for page, html in pages.items():
        for link in re.findall(r'(?:href|src)="([^"]+)"', html):
            path, _, anchor = unquote(unescape(link)).partition("#")
            target = (page.parent / path.partition("?")[0]).resolve() if path else page
            if not re.match(r"[a-z]+:", link) and (
                    not target.exists() or anchor and anchor not in names.get(target, {anchor})):
                found.append(f"{page.name}: {link}")
    return found


def test_every_key_of_the_longest_scenario_is_on_the_page(repository):
    page = keys.page()
    rows = dict(re.findall(r"^\| `([\w.]+)` \| (.*) \|$", page, re.M))
    data = yaml12.read(str(repository / "scenarios" / "maze_30.yaml"))[0]
    missing = [key for key in written_keys(data) if key not in rows
               and not key.startswith((
                   "network.media.NAME.", "coordination.strategy.", "coordination.exchange."))]
    assert not missing
    assert rows["robot.laser.max_range"].startswith("length (m) | `26 m` | ")
    assert rows["stop.explored"].startswith("ratio (%, or 0 to 1) | `99 %` | ")
    assert rows["environment.terrain.maze.cell"].startswith("length (m) | `8 m` | side of a cell")
    assert rows["deployment"].startswith("`testbed`, `field` | `testbed` | ")


def test_every_plug_in_has_its_place_and_its_parameters():
    pages = plugin_pages.pages()
    for kind in plugins.GROUPS:
        for name in plugins.available(kind):
            assert f"## {name}\n" in pages[f"{kind}.md"], name
            assert f"({kind}.md#" in pages["index.md"]
    assert "| `rate` | bit rate (b/s, kb/s, Mb/s, Gb/s) | `1 Gb/s` |" in pages["network.md"]
    assert "Drops for: `queue_full`." in pages["network.md"]
    assert "## office (generated)" in pages["terrain.md"]


def test_every_command_and_its_options_are_there():
    page = commands.page()
    for command in app.registered_commands:
        assert f"## desim {command.name}\n" in page
    assert "| `--set A.B.C=VALUE` | a key's value; can be given again |" in page
    assert "| `--out OUT` | folder for results | `results` |" in page
    assert "desim trace RUN [options]" in page


def test_every_scenario_is_in_the_gallery(repository):
    page = gallery.page({"hello": Drawn("hello.png", "hello.html", "Drawn.")}, repository / "docs")
    for one in shipped():
        assert one.name.endswith("_small") or f"### {one.name}\n" in page
    assert page.index("### hello\n") < page.index("### maze_30\n")
    assert "figure} pictures/hello.png" in page and 'href="../replays/hello.html"' in page
    assert "[What it has shown](../docs/studies/bandwidth.md)" in page


def test_a_picture_and_a_replay_are_made_once(tmp_path):
    hello = next(one for one in shipped() if one.name == "hello")
    kept = tmp_path / "kept"
    found = drawn(hello, tmp_path / "a", tmp_path / "b", kept)
    assert found == ("hello.png", "hello.html", "The first 60 s of 3 robots.")
    assert (tmp_path / "a" / "hello.png").read_bytes().startswith(b"\x89PNG")
    assert "<!doctype html>" in (tmp_path / "b" / "hello.html").read_text()[:100].lower()
    before = {file.name: file.stat().st_mtime_ns for file in kept.iterdir()}
    assert drawn(hello, tmp_path / "c", tmp_path / "d", kept) == found
    assert {file.name: file.stat().st_mtime_ns for file in kept.iterdir()} == before


def test_docstrings_are_meant_word_by_word():
    assert text.prose("One ``a_b`` and x_y,\nover two lines <here>.\n\n    code = 1") == \
        "One `a_b` and x\\_y, over two lines \\<here\\>.\n\n```text\ncode = 1\n```"
    assert text.table(("a",), [("x|y",)]) == "| a |\n| --- |\n| x\\|y |"


def test_every_page_of_the_repository_is_in_the_site(repository, tmp_path):
    build_site.write_sources(tmp_path / "source", {})
    index = (tmp_path / "source" / "index.md").read_text()
    listed = {line for line in index.splitlines() if line.startswith(("docs/", "reference/"))}
    globs = {"docs/studies/*", "docs/middleware/*"}
    for page in (repository / "docs").rglob("*.md"):
        name = page.relative_to(repository).with_suffix("").as_posix()
        assert name in listed or f"{name.rpartition('/')[0]}/*" in listed & globs, name


def test_the_site_is_built_without_a_warning_and_asks_no_other_host(repository, tmp_path):
    pytest.importorskip("sphinx", reason="the extra docs is not installed")
    pytest.importorskip("furo", reason="the extra docs is not installed")
    pytest.importorskip("myst_parser", reason="the extra docs is not installed")
    source, html = tmp_path / "source", tmp_path / "html"
    build_site.write_sources(source, {})
    done = subprocess.run([sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html",
                           "-c", repository / "tools" / "site_pages", source, html],
                          text=True, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    for page in html.rglob("*.html"):
        asked = re.findall(r"<(?:script|img|iframe|link)[^>]*(?:src|href)=\"(?:https?:)?//[^\"]*",
                           page.read_text())
        assert not asked, (page, asked)
    assert dead_links(html) == []
    (html / "reference" / "keys.html").unlink()
    assert any("reference/keys.html" in link for link in dead_links(html))
    assert "@import url(http" not in "".join(file.read_text() for file in html.rglob("*.css"))
