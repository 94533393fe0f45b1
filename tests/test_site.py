"""The documentation site: the pages that are made from the code name everything that is there."""

from __future__ import annotations

import re

import build_site  # a tool
from site_pages import commands, gallery, keys, text
from site_pages import plugins as plugin_pages
from site_pages.links import asked_of_others, dead_links
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
    assert ("| `--set A.B.C=VALUE` | a key's value; a mapping is merged into what is there, null "
            "takes a named entry away; can be given again |") in page
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


def test_a_picture_of_a_scenario_in_a_folder_has_a_plain_name(tmp_path, monkeypatch):
    monkeypatch.setattr("site_pages.pictures._sources", lambda: "0")
    kept = tmp_path / "kept" / "paper_published-0.png"
    kept.parent.mkdir()
    kept.touch()
    published = next(one for one in shipped() if one.name == "paper/published")
    assert drawn(published, tmp_path / "a", tmp_path / "b", kept.parent)[:2] == (
        "paper_published.png", None)
    assert (tmp_path / "a" / "paper_published.png").exists()


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


def test_links_that_lead_nowhere_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<a href="b.html#here"><h1 id="up"><a href="#up"><a href="b.css">'
        '<a href="https://a.org/c.html"><a href="mailto:a@a.org">')
    (tmp_path / "b.html").write_text('<h1 id="here"><img src="a.html?x=1#up">')
    (tmp_path / "b.css").touch()
    assert dead_links(tmp_path) == []
    (tmp_path / "b.html").write_text('<a href="c.html"><a href="#there"><a href="%61.html">')
    assert sorted(dead_links(tmp_path)) == ["a.html: b.html#here", "b.html: #there",
                                            "b.html: c.html"]


def test_what_a_page_asks_of_other_hosts_is_found(tmp_path):
    (tmp_path / "a.html").write_text('<script src="a.js"></script><a href="https://a.org">a</a>')
    (tmp_path / "a.css").write_text("@import url(b.css);")
    assert asked_of_others(tmp_path) == []
    (tmp_path / "a.html").write_text('<script async src="https://a.org/a.js"></script>'
                                     '<link rel="stylesheet" href="//a.org/a.css">')
    (tmp_path / "a.css").write_text("@import url(https://a.org/b.css);")
    assert asked_of_others(tmp_path) == [
        'a.html: <script async src="https://a.org/a.js',
        'a.html: <link rel="stylesheet" href="//a.org/a.css',
        "a.css: @import url(https://a.org/b.css"]
