"""When Linux's timers go off: a little late, the later the longer they run."""

from __future__ import annotations

TICK_NS = 4_000_000  # CONFIG_HZ=250

_LEVELS = 9  # kernel/time/timer.c, LVL_DEPTH
_STARTS = tuple(63 << 3 * level for level in range(_LEVELS))  # LVL_START of the next level


def fires_ns(now_ns: int, delay_ns: int, tick_ns: int) -> int:
    """When a timer fires that is set now for ``delay_ns``. It counts ticks, and is looked for every
    8^n ticks if it runs for 8^n to 8^(n + 1) times 8 of them (Linux kernel/time/timer.c,
    calc_wheel_index: below 63 ticks each one, below 504 every 8th, below 4032 every 64th, ...).
    The ticks of all hosts are those of the simulation's clock. Without ticks (0 ns) it is exact."""
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
