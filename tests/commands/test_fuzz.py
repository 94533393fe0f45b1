"""A few of the cases of tools/fuzz.py, which plays hundreds."""

import sys


def test_what_nobody_would_give_to_desim(repository, monkeypatch, capsys):
    monkeypatch.setattr(sys, "path", [str(repository / "tools"), *sys.path])
    from fuzz import fuzz

    wrong = fuzz(1, range(8))
    assert not wrong, capsys.readouterr().out
