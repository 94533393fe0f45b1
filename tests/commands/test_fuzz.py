"""A few of the cases of tools/damaged.py, which plays hundreds."""

import sys


def test_what_nobody_would_give_to_desim(repository, monkeypatch, capsys):
    monkeypatch.setattr(sys, "path", [str(repository / "tools"), *sys.path])
    from damaged import KINDS, play

    wrong = play([*KINDS], range(4))
    assert not wrong, capsys.readouterr().out
