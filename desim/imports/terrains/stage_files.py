"""World files of Stage: entities with properties, macros (``define``) and included files.

The syntax is that of Stage's worldfile.cc: an included file is named relative to the folder of the
world, what a macro says is read when it is first used, of two definitions of it the first one
counts, and of a property that is given twice the last one.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from desim.errors import InputError
from desim.files import content_below, near

_MOST_BYTES = 10_000_000
_MOST_TOKENS = 500_000
_DEEPEST = 20  # entities in each other, and files that include each other
_TOKEN = re.compile(r"""(?P<space>[^\S\n]+|\#[^\n]*)|(?P<end>\n)|"(?P<text>[^"\n]*)"
    |(?P<mark>[()\[\]])|(?P<number>[-+.\d][-+.\deE]*)|(?P<word>[A-Za-z_][\w.-]*(?:\[\d+\])?)""",
                    re.VERBOSE)


class StageToken(NamedTuple):
    """A token, its kind (a group of the pattern) and its place."""

    kind: str
    text: str
    where: str


class StageValue(NamedTuple):
    """The value of a property: one word, or those of a tuple."""

    words: tuple[str, ...]
    where: str


@dataclass(frozen=True, eq=False)
class StageEntity:
    """An entity of a type that Stage has, with all that its macros say."""

    type: str
    where: str
    values: dict[str, StageValue] = field(default_factory=dict)
    children: tuple[StageEntity, ...] = ()


class StageWorld(NamedTuple):
    """All entities of a world, and the files that could not be included."""

    top: StageEntity
    missing: list[str]


def read(path: Path, content: bytes) -> StageWorld:
    """The entities of a world. Raises ``InputError`` with the file and line."""
    missing: list[str] = []
    tokens = _tokens(str(path), content, path.absolute().parent, missing, 0)
    reading = _Reading([*tokens, StageToken("mark", "", str(path))])
    return StageWorld(reading.body(StageEntity("world", str(path)), "", 0), missing)


def _tokens(file: str, content: bytes, folder: Path, missing: list[str], depth: int,
            ) -> list[StageToken]:
    """All tokens, with those of included files in their places."""
    text, at, line = content.decode("utf-8", "replace").replace("\r", "\n"), 0, 1
    found: list[StageToken] = []
    while at < len(text):
        where = f"{file}:{line}"
        match = _TOKEN.match(text, at)
        if match is None:
            raise InputError(f"{where}: {text[at]!r} is not expected here")
        at, kind = match.end(), str(match.lastgroup)
        line += kind == "end"
        if kind == "text" and found and found[-1][:2] == ("word", "include"):
            found.pop()
            found += _included(match["text"], where, folder, missing, depth)
        elif kind not in ("space", "end"):
            found.append(StageToken(kind, match[kind], where))
        if len(found) > _MOST_TOKENS:
            raise InputError(f"{where}: more than {_MOST_TOKENS} words, files included")
    return found


def _included(name: str, where: str, folder: Path, missing: list[str], depth: int,
              ) -> list[StageToken]:
    if depth == _DEEPEST:
        raise InputError(f"{where}: include: more than {_DEEPEST} files include each other")
    try:
        content = content_below(*near(folder, name), _MOST_BYTES)
    except OSError as error:
        missing.append(f"{name} ({error.strerror or error})")
        return []
    return _tokens(str(folder / name), content, folder, missing, depth + 1)


class _Reading:
    """Tokens, where the macros begin that have been defined so far, and those that are in use."""

    def __init__(self, tokens: list[StageToken]) -> None:
        self._tokens, self._at = tokens, 0
        self._defined: dict[str, int] = {}
        self._macros: dict[str, StageEntity] = {}

    def body(self, entity: StageEntity, closing: str, depth: int) -> StageEntity:
        """The entity with the properties and children up to the token ``closing``."""
        if depth > _DEEPEST:
            raise InputError(f"{entity.where}: more than {_DEEPEST} entities in each other")
        values, children = dict(entity.values), list(entity.children)
        while (token := self._next())[:2] != ("mark", closing):
            if token.kind != "word":
                raise InputError(f"{token.where}: a name is expected, got {token.text!r}" if
                                 token.text else f"{entity.where}: its ) is missing")
            if token.text == "define":
                self._define()
            elif self._ahead("("):
                children.append(self.body(self._begun(token, depth), ")", depth + 1))
            else:
                values[token.text] = self._value(token)
        return replace(entity, values=values, children=tuple(children))

    def _define(self) -> None:
        name, start = self._next(), self._at
        parent = self._next()
        if (name.kind, parent.kind) != ("word", "word") or not self._ahead("("):
            raise InputError(f"{name.where}: define: a name, a type and ( are expected, got "
                             f"{name.text!r} {parent.text!r}")
        self._defined.setdefault(name.text, start)
        still_open = 1
        while still_open and (token := self._next())[:2] != ("mark", ""):
            still_open += (token[:2] == ("mark", "(")) - (token[:2] == ("mark", ")"))
        if still_open:
            raise InputError(f"{name.where}: its ) is missing")

    def _begun(self, token: StageToken, depth: int) -> StageEntity:
        """An entity of a type, with what its macro says."""
        start = self._defined.get(token.text)
        if start is None:
            return StageEntity(token.text, token.where)
        if token.text not in self._macros:
            back, self._at = self._at, start + 2
            parent = self._tokens[start]
            del self._defined[token.text]  # within itself it is a type
            self._macros[token.text] = self.body(self._begun(parent, depth), ")", depth + 1)
            self._defined[token.text], self._at = start, back
        return replace(self._macros[token.text], where=token.where)

    def _value(self, name: StageToken) -> StageValue:
        token = self._next()
        if token[:2] == ("mark", "["):
            words = []
            while (token := self._next())[:2] != ("mark", "]"):
                if token.kind == "mark":
                    raise InputError(f"{name.where}: {name.text}: its ] is missing")
                words.append(token.text)
            return StageValue(tuple(words), name.where)
        if token.kind == "mark":
            raise InputError(f"{name.where}: {name.text}: a value is expected, got "
                             f"{token.text or 'the end of the file'!r}")
        return StageValue((token.text,), name.where)

    def _ahead(self, mark: str) -> bool:
        """Whether a mark comes next, which is passed then."""
        found = self._tokens[self._at][:2] == ("mark", mark)
        self._at += found
        return found

    def _next(self) -> StageToken:
        token = self._tokens[self._at]
        self._at = min(self._at + 1, len(self._tokens) - 1)
        return token
