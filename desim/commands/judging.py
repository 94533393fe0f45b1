"""``desim validate --real``: our models beside the real programs."""

from __future__ import annotations

from pathlib import Path

import typer

from desim.commands.compiling import compiling, compiling_inside
from desim.commands.output import say, say_json
from desim.errors import InputError, did_you_mean


def judge(name: str, seed: int, out: Path | None, as_json: bool) -> None:
    """Print the figures of all rows of the real programs ``name``, those of each row as soon as
    they are there. Raises ``typer.Exit`` with 1 where one is off."""
    with compiling(as_json):
        from desim.commands.views.bars import counting
        from desim.commands.views.terminal import Terminal
        from desim.loop.guest_kernel import guest_kernel
        from desim.validation.real import figures, judge, sections

    if name not in sections.SECTIONS:
        raise InputError(f"--real: there is no {name!r}{did_you_mean(name, sections.SECTIONS)}; "
                         f"known: {', '.join(sections.SECTIONS)}")
    section = sections.SECTIONS[name]
    judge.require(section.needs())
    guest_kernel()
    found = []
    with compiling_inside(as_json), counting(Terminal(), name) as on_progress:
        if not as_json:
            say(figures.HEADER)
        for figure in judge.judged(list(section.rows(seed)), seed, out, on_progress):
            found.append(figure)
            if not as_json:
                say(figure.line)
    far = sum(not figure.near for figure in found)
    if as_json:
        say_json({"real": name, "seed": seed, "failed": far,
                  "rows": [{**figure._asdict(), "ratio": figure.ratio} for figure in found]})
    else:
        say(f"{len(found) - far} of {len(found)} within {100 * figures.NEAR:g} %, "
            "the others have a *")
    if far:
        raise typer.Exit(1)
