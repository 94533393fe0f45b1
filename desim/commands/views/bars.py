"""Bars on a terminal: how much of a task is done. Elsewhere they print nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console, RenderableType
from rich.live import Live
from rich.progress import Progress

from desim.engine.kernel import Kernel

REFRESH_HZ = 4


@contextmanager
def counting(on: Console, what: str, least: int = 0) -> Iterator[Callable[[int, int], None]]:
    """A bar for a task of more than ``least`` parts. Yields a function to call with the number of
    parts that are done and of all."""
    with Progress(console=on, transient=True, disable=not on.is_terminal) as bars:
        bar = bars.add_task(what, total=None, visible=False)
        yield lambda done, total: bars.update(bar, completed=done, total=total,
                                              visible=total > least)


@contextmanager
def following(on: Console, what: str) -> Iterator[Callable[[Kernel, int], None]]:
    """A bar for the clocks of kernels, one after another. Yields a function to call with a kernel
    and the instant until which it will run. The bar reads the clock: the kernel does not notice."""
    bars = Progress(console=on, auto_refresh=False)
    bar = bars.add_task(what, total=None)
    played: list[tuple[Kernel, int]] = []

    def drawn() -> RenderableType:
        for kernel, until_ns in played[-1:]:
            bars.update(bar, completed=kernel.now_ns, total=until_ns)
        return bars.get_renderable()

    def watch(kernel: Kernel, until_ns: int) -> None:
        played.append((kernel, until_ns))
        bars.reset(bar)

    if not on.is_terminal:
        yield watch
        return
    with Live(console=on, refresh_per_second=REFRESH_HZ, transient=True, get_renderable=drawn):
        yield watch
