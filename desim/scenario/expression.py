"""Expressions over named quantities: ``explored > 0.9 and collisions == 0``.

A whitelisted syntax tree, turned into closures once; nothing is ever evaluated as Python. Numbers
and conditions are kept apart, so that a stop condition cannot be a bare number by mistake.

What cannot be computed (a division by zero, a number too large, a quantity that is NaN) is unknown,
here None: so is what is computed from it or compared with it, and ``and``, ``or``, ``not`` follow
Kleene's logic of three values (Introduction to Metamathematics, 1952, section 64).
"""

from __future__ import annotations

import ast
import operator
import re
import sys
from collections.abc import Callable, Collection, Mapping
from itertools import pairwise
from typing import NamedTuple

from desim.errors import InputError, did_you_mean
from desim.scenario.stop_function import StopFunction

Quantities = Mapping[str, float]
_LONGEST, _DEEPEST = 500, 32
_LARGEST = sys.float_info.max
_FUNCTION = re.compile(r"(.*/)?[A-Za-z_][\w.]*:[A-Za-z_]\w*")
_ARITHMETIC: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
_COMPARISONS: dict[type[ast.cmpop], Callable[[float, float], bool]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne}
_CALLS: dict[str, Callable[..., float]] = {"min": min, "max": max, "abs": abs}
_GRAMMAR = ("numbers, names, + - * /, comparisons, and, or, not, min(), max(), abs() and "
            "parentheses")


class Number(NamedTuple):
    """``evaluate(quantities)`` gives a finite number, or None where that is unknown."""

    evaluate: Callable[[Quantities], float | None]


class Condition(NamedTuple):
    """``evaluate(quantities)`` gives true or false, or None where that is unknown; ``text`` is
    what was written, of a function its name."""

    text: str
    evaluate: Callable[[Quantities], bool | None]


def condition(text: str, names: Collection[str]) -> Condition:
    """The condition that ``stop.when`` states: an expression over ``names``, or
    ``package.module:function``, perhaps with its folder in front, of a mapping of the quantities.
    Raises ``InputError`` with what is wrong and allowed."""
    if names_function(text):
        function = StopFunction(text.strip())
        return Condition(function.name, function)
    return of_quantities(text, names)


def of_quantities(text: str, names: Collection[str]) -> Condition:
    """The condition ``text``, an expression over ``names``. Raises ``InputError``."""
    expression = compile(text, names)
    if not isinstance(expression, Condition):
        raise InputError(f"{text!r} is a number, not a condition; compare it with something, "
                         "e.g. 'explored > 0.9'")
    return expression


def number(text: str, names: Collection[str]) -> Number:
    """The number ``text``, an expression over ``names``. Raises ``InputError``."""
    expression = compile(text, names)
    if not isinstance(expression, Number):
        raise InputError(f"{text!r} is a condition where a number is needed, e.g. 'distance_m'")
    return expression


def names_function(text: str) -> bool:
    """Whether it is no expression, but ``package.module:function``."""
    return _FUNCTION.fullmatch(text.strip()) is not None


def compile(text: str, names: Collection[str]) -> Number | Condition:
    """A number or a condition over ``names``. Raises ``InputError`` with what is wrong and allowed.
    """
    if len(text) > _LONGEST:
        raise InputError(f"an expression has at most {_LONGEST} characters, this one {len(text)}")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"{text!r} is not an expression; allowed: {_GRAMMAR}") from None
    return _Compiler(text, names).part(tree.body, 0)


class _Compiler:
    def __init__(self, text: str, names: Collection[str]) -> None:
        self._text = text
        self._names = names

    def part(self, node: ast.AST, depth: int) -> Number | Condition:
        if depth > _DEEPEST:
            raise InputError(f"{self._text!r} is nested deeper than {_DEEPEST}")
        build = getattr(self, f"_{type(node).__name__.lower()}", None)
        if build is None:
            raise self._not_allowed(node)
        return build(node, depth + 1)

    def _number(self, node: ast.AST, depth: int) -> Callable[[Quantities], float | None]:
        part = self.part(node, depth)
        if isinstance(part, Condition):
            raise InputError(f"{self._source(node)!r} is a condition where a number is needed")
        return part.evaluate

    def _condition(self, node: ast.AST, depth: int) -> Callable[[Quantities], bool | None]:
        part = self.part(node, depth)
        if isinstance(part, Number):
            raise InputError(f"{self._source(node)!r} is a number where a condition is needed, "
                             "e.g. 'explored > 0.9'")
        return part.evaluate

    def _constant(self, node: ast.Constant, _: int) -> Number:
        value = node.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self._not_allowed(node)
        if _known(value) is None:
            raise InputError(f"{self._source(node)!r} is not a finite number")
        return Number(lambda quantities: value)

    def _name(self, node: ast.Name, _: int) -> Number:
        name = node.id
        if name not in self._names:
            raise InputError(f"unknown quantity {name!r}{did_you_mean(name, self._names)}; "
                             f"allowed: {', '.join(self._names)}")
        return Number(lambda quantities: _known(quantities[name]))

    def _binop(self, node: ast.BinOp, depth: int) -> Number:
        apply = _ARITHMETIC.get(type(node.op))
        if apply is None:
            raise self._not_allowed(node)
        return _computed(apply, [self._number(node.left, depth), self._number(node.right, depth)])

    def _unaryop(self, node: ast.UnaryOp, depth: int) -> Number | Condition:
        if isinstance(node.op, ast.Not):
            inner = self._condition(node.operand, depth)
            return Condition(self._text, lambda quantities: _negated(inner(quantities)))
        if isinstance(node.op, ast.Invert):
            raise self._not_allowed(node)
        sign = operator.neg if isinstance(node.op, ast.USub) else operator.pos
        return _computed(sign, [self._number(node.operand, depth)])

    def _boolop(self, node: ast.BoolOp, depth: int) -> Condition:
        parts = [self._condition(value, depth) for value in node.values]
        join = _all if isinstance(node.op, ast.And) else _any
        return Condition(self._text, lambda quantities: join([part(quantities) for part in parts]))

    def _compare(self, node: ast.Compare, depth: int) -> Condition:
        parts = [self._number(side, depth) for side in (node.left, *node.comparators)]
        if not all(type(op) in _COMPARISONS for op in node.ops):
            raise self._not_allowed(node)
        tests = [_COMPARISONS[type(op)] for op in node.ops]

        def evaluate(quantities: Quantities) -> bool | None:
            values = [part(quantities) for part in parts]
            return _all([None if one is None or other is None else test(one, other)
                         for test, (one, other) in zip(tests, pairwise(values), strict=True)])

        return Condition(self._text, evaluate)

    def _call(self, node: ast.Call, depth: int) -> Number:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        arguments = len(node.args)
        if name not in _CALLS or node.keywords or (arguments != 1 if name == "abs" else
                                                   arguments < 2):
            raise self._not_allowed(node)
        return _computed(_CALLS[name], [self._number(value, depth) for value in node.args])

    def _not_allowed(self, node: ast.AST) -> InputError:
        return InputError(f"{self._source(node)!r} is not allowed in an expression; allowed: "
                          f"{_GRAMMAR}")

    def _source(self, node: ast.AST) -> str:
        return ast.get_source_segment(self._text.strip(), node) or self._text


def _computed(function: Callable[..., float],
              parts: list[Callable[[Quantities], float | None]]) -> Number:
    def evaluate(quantities: Quantities) -> float | None:
        values = [part(quantities) for part in parts]
        if None in values:
            return None
        try:
            return _known(function(*values))
        except ArithmeticError:
            return None

    return Number(evaluate)


def _known(value: float) -> float | None:
    """A finite number; None for any other, and for an int that no float can hold."""
    return value if abs(value) <= _LARGEST else None


def _negated(value: bool | None) -> bool | None:
    return None if value is None else not value


def _all(values: list[bool | None]) -> bool | None:
    if False in values:
        return False
    return None if None in values else True


def _any(values: list[bool | None]) -> bool | None:
    return _negated(_all([_negated(value) for value in values]))
