"""XML of strangers: read without document types of its own, entities and anything from elsewhere.

A ``<!DOCTYPE>`` that only names a document type is passed over; nothing is fetched for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from desim.errors import InputError
from desim.files import content

_DEEPEST, _MOST_ELEMENTS, _MOST_BYTES = 100, 500_000, 50_000_000


@dataclass(eq=False)
class Element:
    """An element: its tag without the prefix of a namespace, its attributes as they are written,
    the number of its line, the text directly in it and the elements in it."""

    tag: str
    attributes: dict[str, str]
    line: int
    text: str = ""
    children: list[Element] = field(default_factory=list)

    def all(self, *tags: str) -> Iterator[Element]:
        """The children of these tags."""
        return (child for child in self.children if child.tag in tags)

    def first(self, tag: str) -> Element | None:
        """The first child of a tag."""
        return next(self.all(tag), None)


def read(path: Path, most_bytes: int = _MOST_BYTES) -> Element:
    """The root of a document in a file. Raises ``InputError`` as ``parse`` does, and ``OSError``.
    """
    return parse(path, content(path, most_bytes))


def parse(path: object, document: bytes) -> Element:
    """The root of a document, which ``path`` has. Raises ``InputError``, with the line, for what is
    no XML, or too large or too deeply nested."""
    parser = expat.ParserCreate()
    begun = document.lstrip()  # before the declaration, where ROS and Gazebo pass over it
    above = document.count(b"\n", 0, len(document) - len(begun))
    top = Element("", {}, 0)
    open_elements, count = [top], 0

    def refused(reason: str) -> InputError:
        return InputError(f"{path}:{above + parser.CurrentLineNumber}: {reason}")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if len(open_elements) > _DEEPEST:
            raise refused(f"nested too deeply; at most {_DEEPEST} elements")
        if count > _MOST_ELEMENTS:
            raise refused(f"too many elements; at most {_MOST_ELEMENTS}")
        element = Element(tag.rpartition(":")[2], attributes, above + parser.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def end(_: str) -> None:
        element = open_elements.pop()
        element.text = "".join(texts.pop(id(element), ()))

    def text(part: str) -> None:
        texts.setdefault(id(open_elements[-1]), []).append(part)

    def entity(name: str, *_: object) -> None:
        raise refused(f"declares the entity {name!r}; entities of a file's own are not allowed")

    texts: dict[int, list[str]] = {}
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.EntityDeclHandler = text, entity
    parser.buffer_text = True
    try:
        parser.Parse(begun, True)
    except expat.ExpatError as error:
        raise InputError(f"{path}:{above + error.lineno}: cannot be read as XML: "
                         f"{expat.errors.messages[error.code]}") from None
    return top.children[0]
