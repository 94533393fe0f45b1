"""Scenarios of one document with changes, the places of their values, and files that they name."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.errors import InputError
from desim.scenario.load import Variants, changes_of, from_mapping, scenario_document
from desim.scenario.merge import extended

SETTINGS = ("seed=1", "seed=2", "fleet.size=1", "fleet.size=2", "stop.elapsed=5 s")


@pytest.fixture(scope="module")
def document(repository):
    return scenario_document(str(repository / "scenarios" / "hello.yaml"))


@settings(max_examples=20)
@given(st.lists(st.lists(st.sampled_from(SETTINGS), max_size=3), min_size=2, max_size=4))
def test_a_scenario_does_not_depend_on_those_made_before(document, several):
    """Whatever begins alike, in the same order, and whatever comes later."""
    variants = Variants(document)
    for overrides in several:
        changes = changes_of(overrides, None)
        assert variants.of(changes).scenario == Variants(document).of(changes).scenario


@pytest.mark.parametrize(("path", "written"), [
    (("name",), True), (("faults",), True), (("faults", 0), True), (("faults", 0, "at"), True),
    (("faults", 1), False), (("faults", "at"), False), (("faults", 0, "at", 0), False),
    (("faults", 0, "at", "s"), False), (("nobody",), False), (("name", 0), False)])
def test_what_somebody_wrote_has_a_place(tmp_path, path, written):
    """In the file itself, or in the one that it extends."""
    (tmp_path / "base.yaml").write_text("faults: [{at: 5 s}]\n")
    (tmp_path / "case.yaml").write_text("extends: base.yaml\nname: a\n")
    _, places = extended(str(tmp_path / "case.yaml"))
    assert (path in places) is written


def test_a_recording_that_cannot_be_read_is_refused_and_one_that_is_not_there_is_its_models(
        tmp_path):
    def with_file(file):
        return from_mapping({"name": "a", "network": {"media": {
            "lan": {"model": "replay", "file": str(file)}}}})

    assert with_file(tmp_path / "none.csv").scenario.name == "a"
    with pytest.raises(InputError) as caught:
        with_file(tmp_path)
    assert str(caught.value) == (
        f"scenario: network.media.lan.file: {tmp_path}: Is a directory")
