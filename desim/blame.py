"""The cause of an error in one line: a plug-in or a line of code, the host, the simulated time."""

from __future__ import annotations

import inspect
import os
import re
from pathlib import Path
from traceback import walk_tb
from types import FrameType, MethodType
from typing import NamedTuple

from desim import plugins
from desim.engine.kernel import Kernel
from desim.errors import DesimError, ModelError, described, first_line, place_of
from desim.units import NS_PER_S

_ROOT = Path(__file__).resolve().parent.parent  # where other packages may be installed, too
_OURS = {_ROOT / "desim", _ROOT / "netmodels"}
_PLACE = re.compile(r" \((?:[^()]*, )?[\d.]+ s\)$")


class Blame(NamedTuple):
    """``line`` says what happened. ``foreign``: the cause is in a plug-in that is not part of
    desim, or in what some plug-in answered (``ModelError``), so a traceback through desim would not
    help."""

    line: str
    foreign: bool


def blame(error: BaseException) -> Blame:
    """An error of a run in one line: ``strategy bad:Raises raised ZeroDivisionError:
    division by zero at bad.py:7 (robot_3, 2.35 s)``."""
    frames = list(walk_tb(error.__traceback__))
    plugin, line = _plugin(frames)
    when = _place(frames)
    said = described(error)
    words = first_line(error) if isinstance(error, DesimError) else said
    if plugin is None:
        where = "" if isinstance(error, DesimError) else f" at {_line(*frames[-1])}"
        return Blame(f"{words}{where}{when}", isinstance(error, ModelError))
    named = f"{place_of(inspect.unwrap(plugin))} "  # as complaints about what it returned begin
    does = words.removeprefix(named) if words.startswith(named) else f"raised {said}"
    return Blame(f"{plugins.LOADED[plugin]} {does} at {line}{when}",
                 not _is_ours(Path(_file(plugin))))


def cause_of(line: str) -> str:
    """A line of ``blame`` without host and time: equal causes have equal ones."""
    return _PLACE.sub("", line)


def _plugin(frames: list[tuple[FrameType, int]]) -> tuple[type | None, str]:
    """The class of the innermost plug-in whose own code was running, and its line. A rule function
    runs below the frame of the class that wraps it. A callback that takes other arguments never
    ran: its line is its first."""
    last = frames[-1][0]
    callback = last.f_locals.get("fn") if last.f_code is Kernel._loop.__code__ else None
    if isinstance(callback, MethodType) and type(callback.__self__) in plugins.LOADED:
        code = callback.__code__
        return type(callback.__self__), f"{Path(code.co_filename).name}:{code.co_firstlineno}"
    for depth in range(len(frames) - 1, -1, -1):
        cls = type(frames[depth][0].f_locals.get("self"))
        if cls in plugins.LOADED:
            file = _file(cls)
            below = frames[depth:] if hasattr(cls, "__wrapped__") else frames[depth:depth + 1]
            if any(frame.f_code.co_filename == file for frame, _ in below):
                return cls, [_line(*frame) for frame in frames[depth:]
                             if frame[0].f_code.co_filename == file][-1]
    return _beside_plugin(frames)


def _beside_plugin(frames: list[tuple[FrameType, int]]) -> tuple[type | None, str]:
    """The plug-in in whose file the innermost running function stands, a callback, say."""
    classes = {file: cls for cls in plugins.LOADED if not _is_ours(Path(file := _file(cls)))}
    for frame in reversed(frames):
        cls = classes.get(frame[0].f_code.co_filename)
        if cls is not None:
            return cls, _line(*frame)
    return None, ""


def _file(cls: type) -> str:
    """The file of a class; empty where its module has none, as in a notebook, or is gone."""
    try:
        return inspect.getfile(cls)
    except (OSError, TypeError):
        return ""


def _place(frames: list[tuple[FrameType, int]]) -> str:
    """`` (robot_3, 2.35 s)``: the host or medium, and the clock, as far as frames know them."""
    host = now_ns = None
    for frame, _ in reversed(frames):
        owner = frame.f_locals.get("self")
        if owner is None:
            continue
        host = host or _host(owner)
        now_ns = getattr(owner, "now_ns", None) if now_ns is None else now_ns
    parts = [part for part in (host, None if type(now_ns) is not int
                               else f"{now_ns / NS_PER_S:g} s") if part]
    return f" ({', '.join(parts)})" if parts else ""


def _host(owner: object) -> str | None:
    """The host of a node, of its thread, its memory or an end of a topic, or the medium of a model
    or a rule."""
    from desim.middleware.busy.endpoints import QueuedSubscription
    from desim.middleware.busy.executor import Executor
    from desim.middleware.busy.memory import HostMemory
    from desim.middleware.host import Host
    from desim.middleware.node import Node
    from desim.middleware.topics import PolledSubscription, Publisher
    from desim.network.medium import Medium
    from desim.robot.coordination.context import HostContext
    from desim.robot.localization.context import SensorContext
    from desim.robot.sharing.context import MapContext

    if isinstance(owner, Node | Executor | HostMemory | PolledSubscription | Publisher
                  | QueuedSubscription):
        return owner.host.name
    if isinstance(owner, Host | HostContext | MapContext | SensorContext):
        return owner.name
    return f"medium {owner.name}" if isinstance(owner, Medium) else None


def _line(frame: FrameType, number: int) -> str:
    """``bad.py:7``, or ``desim/engine/kernel.py:217`` of ours."""
    file = Path(frame.f_code.co_filename)
    name = os.path.relpath(file, _ROOT) if _is_ours(file) else file.name
    return f"{name}:{number}"


def _is_ours(file: Path) -> bool:
    return not _OURS.isdisjoint(file.resolve().parents)
