"""The timers of Linux: they fire a little late, the later the longer they run."""

from __future__ import annotations

TICK_NS = 4_000_000  # CONFIG_HZ=250

_LEVELS = 9  # kernel/time/timer.c, LVL_DEPTH
_STARTS = tuple(63 << 3 * level for level in range(_LEVELS))  # LVL_START of the next level


def fires_ns(now_ns: int, delay_ns: int, tick_ns: int) -> int:
    """The time at which a timer fires that is set now for ``delay_ns``.

    A timer of less than 63 ticks fires on the tick after its delay. Longer ones are checked only
    every 8, 64, ... ticks (below 504, 4032, ...), so they may be up to an eighth late (Linux
    kernel/time/timer.c, calc_wheel_index). All hosts tick with the simulation's clock. Without
    ticks (0 ns) a timer is exact."""
    if not tick_ns:
        return now_ns + delay_ns
    ticks = -(-delay_ns // tick_ns)
    shift = 0
    for start in _STARTS:
        if ticks < start:
            break
        shift += 3
    return (((now_ns // tick_ns + ticks >> shift) + 1) << shift) * tick_ns


def whole_ticks(delay_ns: int, tick_ns: int) -> int:
    """``delay_ns`` in full ticks (Linux usecs_to_jiffies)."""
    return -(-delay_ns // tick_ns) * tick_ns if tick_ns else delay_ns
