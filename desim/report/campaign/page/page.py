"""The page and its elements: one file of HTML that needs nothing else."""

from __future__ import annotations

import html
from collections.abc import Sequence
from importlib import resources
from string import Template
from typing import NamedTuple


class Section(NamedTuple):
    """A part of the page with an anchor; ``body`` is HTML, ``level`` 2 or 3."""

    anchor: str
    title: str
    body: str
    level: int = 2


def page(title: str, question: str, lead: str, sections: Sequence[Section]) -> str:
    """The whole document. Its heading is the first of the ``question``'s sentences that asks; what
    the design says besides stands below it."""
    asked, mark, more = question.partition("?")
    heading = paragraph(title, "name") + f"<h1>{html.escape(asked + mark)}</h1>" + (
        paragraph(more, "question") if more.strip() else "") if asked \
        else f"<h1>{html.escape(title)}</h1>"
    links = "".join(f'<li class="level{one.level}"><a href="#{one.anchor}">'
                    f"{html.escape(one.title)}</a></li>" for one in sections)
    body = "\n".join(f'<section id="{one.anchor}" class="level{one.level}"><h{one.level}>'
                     f'<a class="anchor" href="#{one.anchor}">{html.escape(one.title)}</a>'
                     f"</h{one.level}>\n{one.body}\n</section>" for one in sections)
    return Template(_asset("page.html")).substitute(
        title=html.escape(title), style=_asset("page.css"), script=_asset("page.js"),
        heading=heading, lead=lead, links=links, body=body)


def lead(answer: Sequence[str], runs: str, seen: str) -> str:
    """The first screen below the question: the answer, what runs it rests on, and the figure
    ``seen``, beside them where there is room."""
    return (f'<div class="lead"><div>{items(answer, "answer")}{paragraph(runs, "note")}</div>'
            f"{seen}</div>")


def paragraph(text: str, kind: str = "") -> str:
    """A paragraph of plain text."""
    return f"<p{f' class={kind}' if kind else ''}>{html.escape(text)}</p>"


def items(texts: Sequence[str], kind: str = "") -> str:
    """A list of plain texts."""
    inner = "".join(f"<li>{html.escape(text)}</li>" for text in texts)
    return f"<ul{f' class={kind}' if kind else ''}>{inner}</ul>" if texts else ""


def figure(svg: str, name: str, caption: str) -> str:
    """A figure with links to its files."""
    files = " ".join(f'<a href="figures/{name}.{ending}">{ending.upper()}</a>'
                     for ending in ("png", "svg", "pdf"))
    return (f'<figure id="figure-{name}"><div class="plot">{svg}</div><figcaption>'
            f'{html.escape(caption)} <span class="files">{files}</span></figcaption></figure>')


def folded(title: str, body: str, opened: bool = False) -> str:
    """An element that opens on a click, for those who want details."""
    return (f"<details{' open' if opened else ''}><summary>{html.escape(title)}</summary>\n"
            f"{body}\n</details>")


def verbatim(text: str) -> str:
    """The text of a file."""
    return f'<pre tabindex="0">{html.escape(text)}</pre>'


def _asset(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text("utf-8")
