"""Bars on a terminal: they show what was done last, and print nothing elsewhere."""

from io import StringIO

import pytest
from rich.console import Console

from desim.commands.views.bars import counting, following
from desim.engine.kernel import Kernel, Phase

S = 1_000_000_000


def console(is_terminal):
    return Console(file=StringIO(), force_terminal=is_terminal, width=80, legacy_windows=False)


@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_count_is_shown_on_a_terminal_only(is_terminal):
    on = console(is_terminal)
    with counting(on, "packets") as done:
        done(1, 4)
    said = on.file.getvalue()
    assert ("packets" in said and " 25%" in said) if is_terminal else said == ""


def test_a_short_task_has_no_bar():
    on = console(True)
    with counting(on, "scenarios", least=4) as done:
        done(3, 4)
    assert "scenarios" not in on.file.getvalue()


@pytest.mark.parametrize("is_terminal", [True, False])
def test_the_clocks_of_kernels_are_followed_one_after_another(is_terminal):
    on = console(is_terminal)
    with following(on, "chain") as watch:
        for until_ns in (4 * S, 2 * S):
            kernel = Kernel()
            watch(kernel, until_ns)
            kernel.at(S, Phase.WORLD, 0, lambda _: None)
            kernel.run(S)
    said = on.file.getvalue()
    assert ("chain" in said and " 50%" in said) if is_terminal else said == ""
