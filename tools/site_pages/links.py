"""The links of a built site: those that lead nowhere, and what its pages ask of other hosts."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path
from urllib.parse import unquote

_LINK = re.compile(r'(?:href|src)="([^"]+)"')
_ASKED = re.compile(r'<(?:script|img|iframe|link)[^>]*(?:src|href)="(?:https?:)?//[^"]*'
                    r'|@import url\(http[^)]*')


def dead_links(site: Path) -> list[str]:
    """The links from page to page that lead nowhere."""
    pages = {page.resolve(): page.read_text() for page in site.rglob("*.html")
             if "_downloads" not in page.parts}
    names = {page: set(re.findall(r'\bid="([^"]+)"', html)) for page, html in pages.items()}
    found = []
    for page, html in pages.items():
        for link in _LINK.findall(html):
            path, _, anchor = unquote(unescape(link)).partition("#")
            target = (page.parent / path.partition("?")[0]).resolve() if path else page
            if not re.match(r"[a-z]+:", link) and (
                    not target.exists() or anchor and anchor not in names.get(target, {anchor})):
                found.append(f"{page.name}: {link}")
    return found


def asked_of_others(site: Path) -> list[str]:
    """The addresses on other hosts that a browser would fetch to show the pages."""
    return [f"{file.name}: {asked}" for kind in ("*.html", "*.css") for file in site.rglob(kind)
            for asked in _ASKED.findall(file.read_text())]
