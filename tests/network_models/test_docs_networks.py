"""The programs in docs/networks-alone.md do what stands there."""

import re


def program(repository, word):
    """The one with this word in it."""
    found, = (text for text in re.findall(
        r"```python\n(.*?)```", (repository / "docs" / "networks-alone.md").read_text(), re.S)
        if word in text)
    return found


def test_a_case_of_your_own(repository, capsys):
    exec(program(repository, "class Relay"), {"__name__": "example"})
    (slow, *wait), (full, *long) = (line.rsplit(" ", 2) for line in
                                    capsys.readouterr().out.splitlines())
    assert (slow, full) == ("1 Mb/s", "1.8 Mb/s")
    assert 5.784 < float(wait[0]) < float(long[0])  # 1446 B at 2 Mb/s


def test_radios_in_a_plain_simpy_program(repository, capsys):
    exec(program(repository, "import simpy"), {})
    said = capsys.readouterr().out
    assert f"```\n{said}```\n" in (repository / "docs" / "networks-alone.md").read_text()
    assert said.startswith("382000 ns: hello arrived at b\n")
