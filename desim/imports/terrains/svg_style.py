"""Paint of shapes in SVG: attributes, ``style`` and simple rules of style sheets."""

from __future__ import annotations

import re
from collections.abc import Iterator

from desim.outside_xml import Element

_COMMENT = re.compile(r"/\*.*?(?:\*/|\Z)", re.DOTALL)
_RULE = re.compile(r"(?<![^{}])([^{}]+)\{([^{}]*)\}")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(%?)")
_VARIABLE = re.compile(r"var\(\s*--[^,()]*(?:,(.*))?\)", re.DOTALL)  # and what counts without it
_RGBA = re.compile(r"rgba?\(([\d.]+)[ ,]+([\d.]+)[ ,]+([\d.]+)[ ,/]+([\d.]+%?)\)")
_INHERITED = ("fill", "stroke", "stroke-width", "fill-rule", "fill-opacity", "stroke-opacity",
              "visibility", "color")
_OWN = ("display", "opacity")
_DARK = 255 / 2  # as in images: nearer to black than to white

Style = dict[str, str]


class StyleSheet:
    """Rules with the selectors ``tag``, ``.class``, ``#id`` and ``tag.class``; others are passed
    over."""

    def __init__(self, root: Element) -> None:
        self._rules: dict[str, Style] = {}
        for text in _sheets(root):
            for selectors, body in _RULE.findall(_COMMENT.sub("", text)):
                for selector in selectors.split(","):
                    self._rules.setdefault(selector.strip(), {}).update(_declared(body))

    def of(self, element: Element, inherited: Style) -> Style:
        """The style of an element in one whose style is ``inherited``."""
        given = element.attributes
        classes = given.get("class", "").split()
        style = {name: value for name, value in inherited.items() if name in _INHERITED}
        style |= {name: given[name].strip() for name in (*_INHERITED, *_OWN) if name in given}
        for selector in (element.tag, *(f".{name}" for name in classes),
                         *(f"{element.tag}.{name}" for name in classes), f"#{given.get('id')}"):
            style |= self._rules.get(selector, {})
        style |= _declared(given.get("style", ""))
        # An opacity holds for all that is in a group, as if each part had it.
        outer = _share(inherited.get("opacity", "1"))
        return style | {"opacity": str(outer * _share(style.get("opacity", "1")))}


def is_shown(style: Style) -> bool:
    """Whether a shape of this style can be seen at all."""
    return style.get("visibility", "visible") == "visible"


def paint(style: Style, what: str) -> bool | None:
    """Whether the ``fill`` or the ``stroke`` of a shape is dark; None where there is none, or none
    that covers what is below it. Raises ``ValueError`` for a colour that cannot be read."""
    from PIL import ImageColor

    text = style.get(what, "black" if what == "fill" else "none")
    if text in ("currentColor", "currentcolor"):
        text = style.get("color", "black")
    if variable := _VARIABLE.fullmatch(text):
        text = (variable[1] or "").strip() or "a variable"
    if text in ("none", "transparent", "") or text.startswith("url("):
        return None
    alpha = _share(style.get(f"{what}-opacity", "1")) * _share(style.get("opacity", "1"))
    if mixed := _RGBA.fullmatch(text):
        grey, alpha = sum(map(float, mixed.groups()[:3])) / 3, alpha * _share(mixed[4])
    else:
        grey = sum(ImageColor.getrgb(text)[:3]) / 3
    if 255 - alpha * (255 - grey) <= _DARK:
        return True
    return False if alpha >= 0.5 else None


def number(text: str, default: float) -> float:
    """The number that a text begins with."""
    found = _NUMBER.match(text)
    return float(found[1]) if found else default


def _share(text: str) -> float:
    found = _NUMBER.match(text)
    return 1.0 if found is None else min(1.0, max(0.0, float(found[1]) * (0.01 if found[2] else 1)))


def _declared(body: str) -> Style:
    pairs = (declaration.partition(":") for declaration in body.split(";"))
    return {name.strip(): value.replace("!important", "").strip() for name, _, value in pairs
            if name.strip() in (*_INHERITED, *_OWN)}


def _sheets(element: Element) -> Iterator[str]:
    if element.tag == "style":
        yield element.text
    for child in element.children:
        yield from _sheets(child)
