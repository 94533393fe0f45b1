"""From a name in a scenario to a class: entry points, or a dotted path that the user writes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from inspect import Parameter, Signature, getattr_static, isfunction, signature
from operator import attrgetter
from typing import Any

from pydantic import ValidationError

from desim import ports
from desim.errors import InputError, did_you_mean, first_line
from desim.modules import module_at, source_of, why
from desim.ports.cases import Case, Validation
from desim.ports.computers import CostModel, MemoryModel, UnusedRows
from desim.ports.local_planners import LocalPlanner, LocalPlannerTraits
from desim.ports.localization import Localization, LocalizationTraits
from desim.ports.middleware import Middleware
from desim.ports.sharing import FollowsScans, SharesOnRequest, Sharing, SharingTraits
from desim.ports.tasks import (
    Briefs,
    FollowsKnowledge,
    GivesMap,
    JudgesMap,
    Measures,
    TakesActions,
    Task,
    TaskTraits,
    VisitsPlaces,
)
from desim.ports.traits import Traits

GROUPS = {
    "network": "desim.networks",
    "rule": "desim.rules",
    "strategy": "desim.strategies",
    "sharing": "desim.sharing",
    "localization": "desim.localization",
    "local_planner": "desim.local_planners",
    "task": "desim.tasks",
    "middleware": "desim.middleware",
    "computers": "desim.computers",
    "world": "desim.worlds",
    "case": "desim.cases",
    "validation": "desim.validation",
}

# The contract whose methods a class must have to be a plug-in of its kind.
CONTRACTS: dict[str, type] = {
    "network": ports.NetworkModel,
    "rule": ports.Rule,
    "strategy": ports.Strategy,
    "sharing": Sharing,
    "localization": Localization,
    "local_planner": LocalPlanner,
    "task": Task,
    "middleware": Middleware,
    "computers": CostModel,
    "world": ports.World,
    "case": Case,
    "validation": Validation,
}

# What a plug-in of a kind may have beside: methods that are called if it has them.
_OPTIONAL: dict[str, tuple[type, ...]] = {
    "strategy": (ports.Starts, ports.FollowsGoals, ports.FollowsMap, ports.FollowsTask,
                 ports.FollowsTeam),
    "sharing": (FollowsScans, SharesOnRequest),
    "task": (Briefs, VisitsPlaces, GivesMap, FollowsKnowledge, JudgesMap, TakesActions,
             Measures),
    "computers": (MemoryModel, UnusedRows),
}
# What the class of a plug-in may declare of itself.
_TRAITS: dict[str, type[Traits]] = {
    "strategy": ports.StrategyTraits,
    "sharing": SharingTraits,
    "localization": LocalizationTraits,
    "local_planner": LocalPlannerTraits,
    "task": TaskTraits,
}
_ALL_OR_NONE = (MemoryModel,)  # of these, one method is of no use without the others

# The parameters that desim makes a plug-in with. (A world is made by its ``build``.)
_MADE_WITH = {**dict.fromkeys(CONTRACTS, ("params",)), "validation": ()}
del _MADE_WITH["world"]

_only_installed: ContextVar[bool] = ContextVar("_only_installed", default=False)
LOADED: dict[type, str] = {}  # every class that was loaded, and what the user calls it


@cache
def available(kind: str) -> dict[str, EntryPoint]:
    """Name to entry point for one of the kinds in ``GROUPS``, sorted by name."""
    return dict(sorted((point.name, point) for point in entry_points(group=GROUPS[kind])))


@cache
def load(kind: str, name: str) -> Any:
    """The class called ``name``: an entry point's name or ``package.module:Class``. A function that
    is a rule is made a class.

    Raises ``InputError`` that says what is known, why the import failed, or how the class breaks
    its contract.
    """
    cls = imported(kind, name if ":" in name else _installed(kind, name))
    if kind == "rule" and isfunction(cls):
        cls = ports.function_rule(cls)
    contract = _contract(kind, cls)
    # A class that only inherits a stub from the contract has no such method, either.
    missing = [f"{method}()" for method in _methods(contract)
               if getattr_static(cls, method, stub := vars(contract)[method]) is stub]
    if missing:
        module = "desim.ports" if hasattr(ports, contract.__name__) else contract.__module__
        raise InputError(f"the {kind} {bare(name)!r} has no {', '.join(missing)}: it is not a "
                         "plug-in for this place; wanted: a class with all methods of "
                         f"{module}.{contract.__name__}")
    if advice := misfit(kind, cls):
        raise InputError(f"the {kind} {bare(name)!r} must {advice}")
    LOADED[cls] = f"{kind} {bare(name)}"
    return cls


def _installed(kind: str, name: str) -> str:
    points = available(kind)
    if name not in points:
        meant = did_you_mean(name, [*points, *([":".join(name.rsplit(".", 1))] * ("." in name))])
        raise InputError(f"unknown {kind} {name!r}{meant}; known: "
                         f"{', '.join(points) or 'none'}, or a dotted path 'package.module:Class'")
    return f"{points[name].module}:{points[name].attr}"


def _contract(kind: str, cls: object) -> type:
    if kind == "network" and hasattr(cls, "build"):
        return ports.Builds
    if kind == "world" and hasattr(cls, "ahead") and not hasattr(cls, "build"):
        return ports.Bodies
    return CONTRACTS[kind]


def _methods(contract: type) -> list[str]:
    return [name for name in vars(contract)
            if not name.startswith("_") and callable(getattr(contract, name))]


def misfit(kind: str, cls: Callable[..., object]) -> str:
    """Advice to the author of a class that breaks the form of its contract: in methods and their
    arguments, in ``reasons`` or ``leads``, in defaults of its ``Params``. Empty if all is well."""
    contract = _contract(kind, cls)
    found = ([_misfit("__init__", cls, _MADE_WITH[kind])]
             if kind in _MADE_WITH and contract is CONTRACTS[kind] else [])
    for part in (contract, *_OPTIONAL.get(kind, ())):
        for name in _methods(part):
            wanted = list(signature(getattr(part, name)).parameters)
            method = getattr_static(cls, name, None)
            if isinstance(method, staticmethod | classmethod):
                wanted = [parameter for parameter in wanted if parameter != "self"]
            if method is not None:
                found.append(_misfit(name, getattr(cls, name), wanted))
            elif part is contract:
                found.append(f"have a method {name}({', '.join(wanted)})")
    members, used = _own_members(cls), _used_names(cls)
    found += _misspelled(kind, members, used)
    found += _undeclared(kind, cls, members, used)
    found += _half(kind, cls)
    for attribute, fewest in (("reasons", 0), ("leads", 1)):
        names = getattr(cls, attribute, None)
        if hasattr(contract, attribute) and not (isinstance(names, tuple) and len(names) >= fewest
                                                 and all(isinstance(name, str) for name in names)):
            found.append(f"declare {attribute} = ('...',), a tuple of names, not {names!r}")
    return ", and ".join(filter(None, (*found, *_wrong_defaults(
        block_of(cls) or ports.Params))))


def _misspelled(kind: str, members: dict[str, object], used: set[str]) -> list[str]:
    """Advice about methods that are named nearly like an event, which nobody calls; ``start``
    is what other plug-ins have for ``on_start``."""
    events = [name for part in (CONTRACTS[kind], *_OPTIONAL.get(kind, ()))
              for name in _methods(part) if name.startswith("on_")]
    begins = "on_start" in events and not any(  # nor is it of another kind at once
        "start" in (methods := set(_methods(one))) and len(methods) > 1 and methods <= {*members}
        for one in CONTRACTS.values())
    named = [name for name, method in members.items() if isfunction(method)
             and (name.startswith("on_") or name == "start" and begins)]
    return [f"have no method {name}, which is never called{meant}" for name in named
            if name not in events and name not in used and not hasattr(CONTRACTS[kind], name)
            and (meant := did_you_mean(name, events))]


def _undeclared(kind: str, cls: Callable[..., object], members: dict[str, object],
                used: set[str]) -> Iterator[str]:
    """Advice about traits that are declared in another form, which nobody reads."""
    traits = _TRAITS.get(kind)
    if traits is None:
        return
    right, known = f"declare traits = {traits.__name__}", traits.__dataclass_fields__
    declared = getattr(cls, "traits", None)
    if not isinstance(declared, traits | None):
        yield f"{right}(...), not {declared!r}"
    for name, value in members.items():
        if name in known and not isfunction(value):
            yield f"{right}({name}=...), not {name} = ..., which nobody reads"
        elif not (callable(value) or name == "traits" or name in used
                  or hasattr(CONTRACTS[kind], name)) and (
                      meant := did_you_mean(name, ["traits", *known])):
            yield f"have no attribute {name}, which nobody reads{meant}"


def _own_members(cls: Callable[..., object]) -> dict[str, object]:
    """The public members that a class and its bases define, by name."""
    return {name: member for base in getattr(cls, "__mro__", ())[-2::-1]
            for name, member in vars(base).items() if not name.startswith("_")}


def _used_names(cls: Callable[..., object]) -> set[str]:
    """The names of attributes and functions that its methods use."""
    return {name for base in getattr(cls, "__mro__", ())[:-1] for method in vars(base).values()
            if isfunction(method) for name in method.__code__.co_names}


def _half(kind: str, cls: Callable[..., object]) -> list[str]:
    """Advice about methods whose companions are missing, so that none of them is called."""
    parts = [_methods(part) for part in _OPTIONAL.get(kind, ()) if part in _ALL_OR_NONE]
    return [f"have {' and '.join(names)}, or none of them: it has no {name}" for names in parts
            for name in names if not hasattr(cls, name) and any(hasattr(cls, one) for one in names)]


def _misfit(name: str, function: Callable[..., object], wanted: Sequence[str]) -> str:
    """Advice to take the arguments that are ``wanted``, unless ``function`` does."""
    taken = signature(function, follow_wrapped=False)
    try:
        taken.bind(*wanted)
    except TypeError:
        names = taken.replace(return_annotation=Signature.empty, parameters=[
            one.replace(annotation=Parameter.empty) for one in taken.parameters.values()])
        return f"take ({', '.join(wanted)}) in {name}, not {names}"
    return ""


def _wrong_defaults(block: type[ports.Params]) -> list[str]:
    try:
        block.model_validate_json("{}", strict=True)
    except ValidationError as error:
        return [f"correct the default of {wrong['loc'][0]}, {wrong['input']!r}: "
                f"{wrong['msg'].removeprefix('Value error, ')}"
                for wrong in error.errors() if wrong["loc"] and wrong["type"] != "missing"]
    return []


def block_of(cls: object) -> type[ports.Params] | None:
    """The parameter block inside of a plug-in's class."""
    block = getattr(cls, "Params", None)
    return block if isinstance(block, type) and issubclass(block, ports.Params) else None


@cache
def parameters(kind: str, name: str) -> type[ports.Params]:
    """The parameter block of the plug-in called ``name``. Raises ``InputError``."""
    block = block_of(load(kind, name))
    if block is None:
        raise InputError(f"the {kind} {bare(name)!r} has no class Params, a desim.ports.Params: it "
                         "needs one, if only an empty one")
    return ports.with_scope(block) if kind == "rule" else block


def beside(name: str, folder: str) -> str:
    """A dotted path, with ``folder`` in front where its module stands there: it can be loaded later
    without knowing the folder. Any other name as it is."""
    module, _, attribute = name.rpartition(":")
    place = os.path.abspath(os.path.join(folder, module))
    return f"{place}:{attribute}" if module and source_of(place) else name


def module_of(kind: str, name: str) -> str:
    """The module that a plug-in or function is named by; it may only import it from another."""
    path = name if ":" in name else _installed(kind, name)
    return os.path.basename(path).partition(":")[0]


def bare(name: str) -> str:
    """A name without its folder: as the user wrote it."""
    return os.path.basename(name)


@contextmanager
def installed_only() -> Iterator[None]:
    """Inside, no code is imported but that of desim and of installed plug-ins: names come from a
    folder of results, which somebody else may have made."""
    token = _only_installed.set(True)
    try:
        yield
    finally:
        _only_installed.reset(token)


def imported(kind: str, path: str) -> Any:
    """The object at ``package.module:name`` or ``folder/package.module:name``; without a folder,
    modules are also looked for in the current directory.

    Raises ``InputError`` that says why there is no such thing.
    """
    if _only_installed.get() and path not in _paths(kind):
        raise InputError(f"the {kind} {bare(path)!r} is no installed plug-in, and the code that a "
                         "folder of results names does not run unless you trust it: --trust")
    place, _, attribute = path.rpartition(":")
    try:
        module = module_at(*os.path.split(place))
    except (Exception, SystemExit) as error:  # a user's module may fail in any way
        raise InputError(f"cannot load {kind} {bare(path)!r}: {why(error, place)}") from error
    try:
        return attrgetter(attribute)(module)
    except AttributeError as error:
        own = [name for name, one in vars(module).items() if not name.startswith("_")
               and getattr(one, "__module__", None) == module.__name__]
        raise InputError(f"cannot load {kind} {bare(path)!r}: {first_line(error)}"
                         f"{did_you_mean(attribute, own)}; it defines: "
                         f"{', '.join(own) or 'nothing'}") from error


def _paths(kind: str) -> list[str]:
    points = available(kind).values() if kind in GROUPS else ()
    return [f"{point.module}:{point.attr}" for point in points]


@cache
def reference(kind: str, name: str, cls: type) -> str:
    """``package.module:Class``, with its distribution and version where it has one: what a run's
    identity records of a plug-in."""
    point = available(kind).get(name)
    distribution = point.dist if point is not None else None
    version = f" ({distribution.name} {distribution.version})" if distribution else ""
    return f"{cls.__module__}:{cls.__qualname__}{version}"
