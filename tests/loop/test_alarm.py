"""Alarms at instants of the monotonic clock."""

from __future__ import annotations

import select
import time

import pytest

from desim.loop.alarm import Alarm


def rings(alarm, within_s):
    return select.select([alarm.descriptor], [], [], within_s)[0] == [alarm.descriptor]


def test_it_rings_at_its_instant_and_not_before():
    alarm, at_ns = Alarm(), time.monotonic_ns() + 2_000_000
    alarm.set(at_ns)
    assert rings(alarm, None)
    assert time.monotonic_ns() >= at_ns


def test_one_that_is_over_rings_at_once_and_until_it_is_set_again():
    alarm = Alarm()
    alarm.set(1)
    assert rings(alarm, None) and rings(alarm, 0)
    alarm.set(time.monotonic_ns() + 3600 * 10**9)
    assert not rings(alarm, 0)


def test_what_linux_refuses_is_an_error():
    with pytest.raises(OSError, match="Invalid argument"):
        Alarm().set(-1 << 40)
