"""YAML 1.2 with places: the core schema (``1e6`` is a number, ``no`` is text), no duplicate keys.

PyYAML reads YAML 1.1, so its tables of plain scalars are replaced by those of the YAML 1.2.2
specification, section 10.3.2, for reading and for writing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import yaml

try:  # libyaml reads ten times as fast, and writes four times as fast
    from yaml import CSafeDumper as SafeDumper
    from yaml import CSafeLoader as FastLoader
except ImportError:
    from yaml import SafeDumper
    from yaml import SafeLoader as FastLoader

from desim import outside_yaml
from desim.errors import InputError
from desim.files import content
from desim.scenario.source_places import Data, Path, Places, SourcePlace

_CORE = {
    "null": (r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
    "bool": (r"^(?:true|True|TRUE|false|False|FALSE)$", list("tTfF")),
    "int": (r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$", list("-+0123456789")),
    "float": (r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
              r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$", list("-+0123456789.")),
}
_TAG = "tag:yaml.org,2002:"
_LONGEST_NUMBER = 40
MOST_BYTES = 10_000_000  # of a file
_MOST_COMPLAINTS = 20


class _Loader(yaml.SafeLoader):
    yaml_implicit_resolvers: dict[str, object] = {}


class _FastLoader(FastLoader):
    yaml_implicit_resolvers: dict[str, object] = {}


class _Dumper(SafeDumper):
    yaml_implicit_resolvers: dict[str, object] = {}

    def ignore_aliases(self, data: object) -> bool:
        return True

    def represent_list(self, data: Sequence[object]) -> yaml.Node:
        short = len(repr(data)) <= 80 and not any(isinstance(item, dict) for item in data)
        return self.represent_sequence(_TAG + "seq", data, flow_style=short)


for _name, (_pattern, _first) in _CORE.items():
    for _class in (_Loader, _FastLoader, _Dumper):
        _class.add_implicit_resolver(_TAG + _name, re.compile(_pattern), _first)
for _type in (list, tuple):
    _Dumper.add_representer(_type, _Dumper.represent_list)


def dump(data: Data) -> str:
    """Block style YAML that ``parse`` reads back to the same ``data``; short lists on one line."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=1000,
                     default_flow_style=False)


def read(path: str) -> tuple[Data, Places]:
    """The mapping in a file, and where its parts stand. Raises ``InputError``."""
    return parse(_text(path), path)


def read_as_ros(path: str) -> tuple[object, Places, list[str]]:
    """The mapping in a file of ROS, where its parts stand, and complaints about it: of two equal
    keys the last one counts. Raises ``InputError`` for what is no YAML, and no mapping."""
    return _Builder(path).anyway(_composed(_text(path), path))


def _text(path: str) -> str:
    try:
        return content(path, MOST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: not a text file (UTF-8)") from None
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read: {reason}") from None


def parse(text: str, source: str) -> tuple[Data, Places]:
    """The mapping that ``text`` holds, and where its parts stand. Raises ``InputError``."""
    return _Builder(source).whole(_composed(text, source))


def _composed(text: str, source: str) -> yaml.MappingNode:
    """The node of the mapping that ``text`` holds."""
    node = _compose(text, source)
    if node is None:
        raise InputError(f"{source}: is empty; a scenario is a mapping, e.g. 'name: hello'")
    if not isinstance(node, yaml.MappingNode):
        kind = "a list" if isinstance(node, yaml.SequenceNode) else "a single value"
        raise InputError(f"{_place(node, source)}: is {kind}; a scenario is a mapping, "
                         "e.g. 'name: hello'")
    return node


def parse_value(text: str, source: str) -> object:
    """The value that stands on a command line. Raises ``InputError``."""
    node = _compose(text, source, marked=False)
    return None if node is None else _Builder(source, marked=False).whole(node)[0]


def _compose(text: str, source: str, marked: bool = True) -> yaml.Node | None:
    with suppress(yaml.YAMLError):
        try:
            outside_yaml.check(text)
        except ValueError as error:
            raise InputError(f"{source}: {error}") from None
        return yaml.compose(text, Loader=_FastLoader)
    try:
        return yaml.compose(text, Loader=_Loader)  # it says better what is wrong, and where
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{source}:{mark.line + 1}:{mark.column + 1}" if marked else source
        problem = error.problem or error.context
        if problem.startswith("but "):
            problem = f"{error.context}, {problem}"
        if "'\\t'" in problem:
            problem = "a tab; indent with spaces"
        raise InputError(f"{where}: not YAML: {problem}") from None
    except yaml.YAMLError as error:
        problem = getattr(error, "reason", "unreadable")
        raise InputError(f"{source}: not YAML: {problem}") from None
    except RecursionError:
        raise InputError(f"{source}: nested too deeply") from None


def _place(node: yaml.Node, source: str) -> SourcePlace:
    return SourcePlace(source, node.start_mark.line + 1, node.start_mark.column + 1)


class _Builder:
    """Values from nodes; all complaints are gathered before one error is raised."""

    def __init__(self, source: str, marked: bool = True) -> None:
        self._source = source
        self._marked = marked
        self._complaints: list[str] = []
        self._open: set[int] = set()  # nodes being built: an alias to one of them is a circle

    def whole(self, node: yaml.Node) -> tuple[Any, Places]:
        """The value of a whole document, and the places of its parts. Raises ``InputError``."""
        data, places, complaints = self.anyway(node)
        if complaints:
            raise InputError(*complaints[:_MOST_COMPLAINTS], *(
                [f"{self._source}: and {len(complaints) - _MOST_COMPLAINTS} more complaints"]
                if len(complaints) > _MOST_COMPLAINTS else []))
        return data, places

    def anyway(self, node: yaml.Node) -> tuple[object, Places, list[str]]:
        """The value of a whole document, the places of its parts, and all complaints."""
        self._places = Places(self._place(node))
        try:
            return self._build(node, ()), self._places, self._complaints
        except RecursionError:
            raise InputError(f"{self._source}: nested too deeply") from None

    def _build(self, node: yaml.Node, path: Path) -> object:
        if id(node) in self._open:
            raise InputError(f"{self._place(node)}: an alias that contains itself")
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node)
        self._open.add(id(node))
        if node.tag not in (_TAG + "map", _TAG + "seq"):
            self._complain(node, f"the tag {node.tag!r} is not allowed")
        build = self._mapping if isinstance(node, yaml.MappingNode) else self._sequence
        data = build(node, path)
        self._open.remove(id(node))
        return data

    def _mapping(self, node: yaml.MappingNode, path: Path) -> Data:
        data: Data = {}
        for key_node, value_node in node.value:
            key = key_node.value
            if key_node.tag != _TAG + "str":
                self._complain(key_node, f"the key {key!r} must be text" if
                               isinstance(key, str) else "a key must be text")
                continue
            if key in data:
                first = self._places.key((*path, key)).line
                self._complain(key_node, f"the key {key!r} stands here a second time, first in "
                                         f"line {first}")
            below = (*path, key)
            self._places.put(below, self._place(key_node),
                             self._place(value_node))
            data[key] = self._build(value_node, below)
        return data

    def _sequence(self, node: yaml.SequenceNode, path: Path) -> list[object]:
        data = []
        for index, item in enumerate(node.value):
            place = self._place(item)
            self._places.put((*path, index), place, place)
            data.append(self._build(item, (*path, index)))
        return data

    def _scalar(self, node: yaml.ScalarNode) -> object:
        kind, text = node.tag.removeprefix(_TAG), node.value
        if kind == "str":
            return text
        if kind not in _CORE or not re.match(_CORE[kind][0], text):
            self._complain(node, f"the tag {node.tag!r} is not allowed for {text!r}")
            return None
        if kind == "null":
            return None
        if kind == "bool":
            return text.lower() == "true"
        if len(text) > _LONGEST_NUMBER:
            self._complain(node, f"{text} has too many digits; at most {_LONGEST_NUMBER}")
            return None
        number = (int(text, {"0o": 8, "0x": 16}.get(text[:2], 10)) if kind == "int" else
                  float(re.sub(r"\.(?=[iInN])", "", text)))
        if not -math.inf < number < math.inf:
            self._complain(node, f"{text} is not a finite number")
        return number

    def _complain(self, node: yaml.Node, text: str) -> None:
        self._complaints.append(f"{self._place(node)}: {text}")

    def _place(self, node: yaml.Node) -> SourcePlace:
        return _place(node, self._source) if self._marked else SourcePlace(self._source)
