"""The words of docstrings, pages and names: what tools/prose.py finds. `make lint` calls it."""

from pathlib import Path

import pytest
from page_words import count, pages
from prose import ROOT, findings


@pytest.mark.parametrize("text, why", [
    ('"""What is sent later but is in earlier does not delay it."""', "opens with 'What'"),
    ('"""Frames.\n\nWhoever hears one may answer."""', "'whoever'"),
    ('"""Frames that wait for\nothers."""', "does not end"),
    ('def look():\n    """Count the workers."""', "the name look"),
    ('class Told:\n    """A message."""', "the name Told"),
    ("class Sights: ...", "the name Sights"),
    ("async def look_up(): ...", "the name look_up"),
    ("def plan(wavefronts): ...", "the name wavefronts"),
    ("def plan(*, by_luck=0): ...", "the name by_luck"),
    ("self.told = 3", "the name told"),
    ("for sight in pairs: ...", "the name sight"),
    ("class Row:\n    luck: int", "the name luck"),
    ("LUCK = 3", "the name LUCK"),
    ("MAX_LOOKS: int = 3", "the name MAX_LOOKS"),
    ("import numpy as luck", "the name luck"),
    ("try: ...\nexcept ValueError as told: ...", "the name told")])
def test_a_bad_docstring_and_a_bad_name_are_found(tmp_path: Path, text, why):
    file = tmp_path / "a.py"
    file.write_text(text)
    found, = findings([file])
    assert why in str(found)


@pytest.mark.parametrize("path", ["luck.py", "sights/__init__.py"])
def test_a_bad_name_of_a_module_is_found(tmp_path: Path, path):
    file = tmp_path / path
    file.parent.mkdir(exist_ok=True)
    file.touch()
    found, = findings([file])
    assert f"the name {path.partition('/')[0].removesuffix('.py')}" in str(found)


def test_what_others_named_may_be_used(tmp_path: Path):
    file = tmp_path / "a.py"
    file.write_text("x = text.split(look=3)\nfrom a import luck as chance\ny = told")
    assert findings([file]) == []


def test_a_bad_word_of_a_page_is_found_outside_of_code(tmp_path: Path):
    page = tmp_path / "a.md"
    page.write_text("Good.\n```\nwhoever\n```\nIt goes to whoever asks.\n")
    found, = findings([page])
    assert found.line == 5


# Of docs/: 53 700, and 106 for networks that are other simulators, 800 for real programs, 300 for
# runs step by step and agents that learn, 920 for access points and two studies of them, 802.11n to
# ax, and cellular links, 80 for rates as Linux learns them, 60 for robots in ROS 2, 90 for low-rate
# radios, 40 for who hangs on whom, 95 for programs of one's own, 350 for deliveries
# and traffic, 350 for local planners, 205 for the judge of real programs, 510 for a
# pose graph of the fleet, 345 for Linux's access points and queues, 166 for faults
# and places of access points, 335 for cards. It only falls.
MOST_WORDS = 62_500


def test_pages_are_no_longer_than_they_were():
    assert len((ROOT / "README.md").read_text().split()) <= 450
    assert sum(page.words for path, page in pages().items() if path != "README.md") <= MOST_WORDS


def test_sentences_are_short():
    """At most 25 words in the mean of each page."""
    long = {path: page.in_sentences / page.sentences for path, page in pages().items()
            if page.sentences and page.in_sentences > 25 * page.sentences}
    assert long == {}


def test_words_in_code_tables_and_links_are_no_sentences():
    text = ("# A head\n\nOne two [three](four.md).\n\n```\ncode\n```\n\n| a | b |\n\n"
            "Five six seven.\n")
    assert count(text) == (10, 6, 2)
