"""The guard of a child process: its parent in the campaign's place, and that of all orphans.

What a plug-in sends to its parent meets the guard, which ends the child. When the child is dead, no
process that it has started lives on, in whatever session.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

from desim.operating_system.resources import children
from desim.operating_system.signals import cause_of_death, signal_name

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36  # prctl(2)


def guarded(life: int, connection: int) -> None:
    """Split this process into a guard and a child, which goes on. The guard writes into ``life``
    the cause of the child's death."""
    campaign, guard = os.getppid(), os.getpid()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    _inherit_orphans_and_die_with(campaign, signal.SIGTERM)
    child = os.fork()
    if child:
        os.close(connection)
        try:
            os.write(life, _end_of(child, campaign).encode("ascii"))
        finally:
            os.killpg(guard, signal.SIGKILL)  # with those that /proc has not shown
    os.close(life)
    # Even where a plug-in's machine code never lets Python have its turn.
    _inherit_orphans_and_die_with(guard, signal.SIGKILL)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _inherit_orphans_and_die_with(parent: int, number: int) -> None:
    libc = ctypes.CDLL(None)
    libc.prctl(_PR_SET_CHILD_SUBREAPER, 1)
    libc.prctl(_PR_SET_PDEATHSIG, number)
    if os.getppid() != parent:
        sys.exit()


def _end_of(child: int, campaign: int) -> str:
    """Wait for the child's death or for a signal, which also the campaign's death sends; kill all
    that is left. Returns the cause."""
    met = _signal_before_death(child)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    _kill_children()
    if met is None or met.si_pid == campaign:
        return cause_of_death(os.waitstatus_to_exitcode(status))
    name = signal_name(met.si_signo)
    return (f"it sent {name} to its parent" if met.si_pid == child else
            f"{name} was sent to its parent")


def _signal_before_death(child: int) -> signal.struct_siginfo | None:
    while os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        met = signal.sigwaitinfo(signal.valid_signals())
        if met.si_signo != signal.SIGCHLD:
            return met
    return None


def _kill_children() -> None:
    """Kill this process's children, and the orphans that it inherits by that, until there are none.
    """
    while any(_is_killed(pid) for pid in children()):
        pass


def _is_killed(child: int) -> bool:
    try:
        os.kill(child, signal.SIGKILL)
    except PermissionError:  # it is another user's, as of sudo
        return False
    os.waitpid(child, 0)
    return True
