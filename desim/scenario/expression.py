"""Expressions over named quantities: ``explored > 0.9 and collisions == 0``.

A whitelisted syntax tree, turned into closures once; nothing is ever evaluated as Python. Numbers
and conditions are kept apart, so that a stop condition cannot be a bare number by mistake.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

from desim import plugins
from desim.errors import InputError, did_you_mean

Quantities = Mapping[str, float]
_LONGEST, _DEEPEST = 500, 32
_FUNCTION = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
_ARITHMETIC = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
               ast.Div: operator.truediv}
_COMPARISONS = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt,
                ast.GtE: operator.ge, ast.Eq: operator.eq, ast.NotEq: operator.ne}
_CALLS = {"min": min, "max": max, "abs": abs}
_GRAMMAR = ("numbers, names, + - * /, comparisons, and, or, not, min(), max(), abs() and "
            "parentheses")


class Expression(NamedTuple):
    """``evaluate(quantities)`` gives a bool where ``is_condition``, else a number. It raises
    ``InputError`` for a division by zero."""

    text: str
    is_condition: bool
    evaluate: Callable[[Quantities], Any]


class _Part(NamedTuple):
    is_condition: bool
    evaluate: Callable[[Quantities], Any]


def condition(text: str, names: Collection[str]) -> Expression:
    """What ``stop.when`` says: a condition, or ``package.module:function`` of a mapping of the
    quantities. Raises ``InputError`` with what is wrong and allowed."""
    if _FUNCTION.fullmatch(text.strip()):
        function = plugins.imported("function", text.strip())
        if not callable(function):
            raise InputError(f"{text!r} is not a function")
        return Expression(text, True, lambda quantities: bool(function(quantities)))
    expression = compile(text, names)
    if not expression.is_condition:
        raise InputError(f"{text!r} is a number, not a condition; compare it with something, "
                         "e.g. 'explored > 0.9'")
    return expression


def compile(text: str, names: Collection[str]) -> Expression:
    """An expression over ``names``. Raises ``InputError`` with what is wrong and allowed."""
    if len(text) > _LONGEST:
        raise InputError(f"an expression has at most {_LONGEST} characters, this one {len(text)}")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"{text!r} is not an expression; allowed: {_GRAMMAR}") from None
    part = _Compiler(text, names).part(tree.body, 0)

    def evaluate(quantities: Quantities) -> Any:
        try:
            return part.evaluate(quantities)
        except ZeroDivisionError:
            raise InputError(f"{text!r} divides by zero at "
                             f"{_values(tree, quantities)}") from None

    return Expression(text, part.is_condition, evaluate)


class _Compiler:
    def __init__(self, text: str, names: Collection[str]) -> None:
        self._text = text
        self._names = names

    def part(self, node: ast.AST, depth: int) -> _Part:
        if depth > _DEEPEST:
            raise InputError(f"{self._text!r} is nested deeper than {_DEEPEST}")
        build = getattr(self, f"_{type(node).__name__.lower()}", None)
        if build is None:
            raise self._not_allowed(node)
        return build(node, depth + 1)

    def _number(self, node: ast.AST, depth: int) -> Callable[[Quantities], Any]:
        part = self.part(node, depth)
        if part.is_condition:
            raise InputError(f"{self._source(node)!r} is a condition where a number is needed")
        return part.evaluate

    def _condition(self, node: ast.AST, depth: int) -> Callable[[Quantities], Any]:
        part = self.part(node, depth)
        if not part.is_condition:
            raise InputError(f"{self._source(node)!r} is a number where a condition is needed, "
                             "e.g. 'explored > 0.9'")
        return part.evaluate

    def _constant(self, node: ast.Constant, _: int) -> _Part:
        value = node.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self._not_allowed(node)
        if not math.isfinite(value):
            raise InputError(f"{self._source(node)!r} is not a finite number")
        return _Part(False, lambda quantities: value)

    def _name(self, node: ast.Name, _: int) -> _Part:
        name = node.id
        if name not in self._names:
            raise InputError(f"unknown quantity {name!r}{did_you_mean(name, self._names)}; "
                             f"allowed: {', '.join(self._names)}")
        return _Part(False, operator.itemgetter(name))

    def _binop(self, node: ast.BinOp, depth: int) -> _Part:
        apply = _ARITHMETIC.get(type(node.op))
        if apply is None:
            raise self._not_allowed(node)
        left, right = self._number(node.left, depth), self._number(node.right, depth)
        return _Part(False, lambda quantities: apply(left(quantities), right(quantities)))

    def _unaryop(self, node: ast.UnaryOp, depth: int) -> _Part:
        if isinstance(node.op, ast.Not):
            inner = self._condition(node.operand, depth)
            return _Part(True, lambda quantities: not inner(quantities))
        if isinstance(node.op, ast.Invert):
            raise self._not_allowed(node)
        inner = self._number(node.operand, depth)
        sign = -1 if isinstance(node.op, ast.USub) else 1
        return _Part(False, lambda quantities: sign * inner(quantities))

    def _boolop(self, node: ast.BoolOp, depth: int) -> _Part:
        parts = [self._condition(value, depth) for value in node.values]
        join = all if isinstance(node.op, ast.And) else any
        return _Part(True, lambda quantities: join(part(quantities) for part in parts))

    def _compare(self, node: ast.Compare, depth: int) -> _Part:
        parts = [self._number(side, depth) for side in (node.left, *node.comparators)]
        tests = [_COMPARISONS.get(type(op)) for op in node.ops]
        if None in tests:
            raise self._not_allowed(node)

        def evaluate(quantities: Quantities) -> bool:
            values = [part(quantities) for part in parts]
            return all(test(*pair) for test, pair in
                       zip(tests, zip(values, values[1:], strict=False), strict=True))

        return _Part(True, evaluate)

    def _call(self, node: ast.Call, depth: int) -> _Part:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        arguments = len(node.args)
        if name not in _CALLS or node.keywords or (arguments != 1 if name == "abs" else
                                                   arguments < 2):
            raise self._not_allowed(node)
        function = _CALLS[name]
        parts = [self._number(value, depth) for value in node.args]
        return _Part(False, lambda quantities: function(*(part(quantities) for part in parts)))

    def _not_allowed(self, node: ast.AST) -> InputError:
        return InputError(f"{self._source(node)!r} is not allowed in an expression; allowed: "
                          f"{_GRAMMAR}")

    def _source(self, node: ast.AST) -> str:
        return ast.get_source_segment(self._text.strip(), node) or self._text


def _values(tree: ast.AST, quantities: Quantities) -> str:
    used = {node.id: None for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return ", ".join(f"{name} = {quantities[name]}" for name in used if name in quantities)
