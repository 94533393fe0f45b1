"""A plain function as a rule."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from inspect import isfunction, signature
from typing import cast

from desim.errors import InputError, ModelError, place_of
from desim.ports import parameters
from desim.ports.frames import Deliver, Drop, Duplicate, Frame, Pass, Verdict
from desim.ports.networks import Rule, RuleContext

# Called as ``function(frame, receivers)`` or ``function(frame, receivers, context)``. Gives a
# verdict for all of ``receivers``, or a list with one for each, or None: all of them pass. Its
# drops, ``Drop()``, carry its name as their reason.
RuleFunction = Callable[..., Verdict | Sequence[Verdict] | None]


def function_rule(function: RuleFunction) -> type[Rule]:
    """The class of rules that ask ``function``. It has no parameters. Raises ``InputError`` for a
    function with other arguments."""
    wanted = [_takes(function, count) for count in (2, 3)]
    if not any(wanted):
        raise InputError(f"{place_of(function)} takes {signature(function)}; a function that is a "
                         "rule takes (frame, receivers) or (frame, receivers, context)")
    own = function.__name__

    @wraps(function, updated=())
    class FunctionRule:
        """A rule that asks one function."""

        Params = parameters.Params
        reasons = (own,)

        def __init__(self, params: parameters.Params | None = None) -> None:
            """There is nothing to set."""

        def start(self, context: RuleContext, hosts: tuple[str, ...]) -> None:
            self._more = () if wanted[0] else (context,)

        def judge(self, frame: Frame, receivers: tuple[int, ...]) -> Sequence[Verdict] | None:
            given = function(frame, receivers, *self._more)
            if isinstance(given, Pass | Deliver | Drop | Duplicate):
                return [_named(given)] * len(receivers)
            return [_named(verdict) for verdict in given] if isinstance(given, list) else given

    def _named(verdict: Verdict) -> Verdict:
        if type(verdict) is not Drop:
            return verdict
        if verdict.reason:
            raise ModelError(f"{place_of(function)} dropped for {verdict.reason!r}; the drops of a "
                             f"function carry its name, {own!r}: write Drop()")
        return verdict._replace(reason=own)

    return FunctionRule


def rule_of(rule: Rule | RuleFunction) -> Rule:
    """``rule`` as an object: a function is wrapped in a ``FunctionRule``."""
    # ``isfunction`` says nothing of what is no function.
    return function_rule(rule)() if isfunction(rule) else cast(Rule, rule)


def _takes(function: RuleFunction, count: int) -> bool:
    """Whether ``function`` accepts ``count`` positional arguments."""
    try:
        signature(function).bind(*range(count))
    except TypeError:
        return False
    return True
