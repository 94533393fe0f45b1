"""The gallery: every shipped scenario with its question, a picture and a replay of its start."""

from __future__ import annotations

from pathlib import Path

from desim.scenario import yaml12
from desim.scenario.shipped import Shipped, folder, shipped
from site_pages.pictures import Drawn, fleet
from site_pages.text import inline

_TITLES = {"desim run": "Scenarios", "desim loop": "Real programs", "desim sweep": "Studies",
           "desim net layout": "Layouts of a network"}


def chosen(command: str) -> list[Shipped]:
    """The shipped files that the gallery shows for a command, small fleets first."""
    found = [one for one in shipped() if one.command == command
             and not one.name.endswith("_small")]
    return sorted(found, key=fleet) if command == "desim run" else found


def page(drawn: dict[str, Drawn], docs: Path) -> str:
    """The page in Markdown. ``drawn``: by the name of a scenario; ``docs`` has the reports of
    studies, with figures."""
    parts = ["# Gallery", "`desim new NAME` writes any of these into your folder, with what it "
                          "needs, and prints the command that plays it."]
    for command, title in _TITLES.items():
        parts.append(f"## {title}")
        for one in chosen(command):
            parts += [f"### {one.name}", f"**{inline(one.question)}**"]
            if one.name in drawn:
                parts += _run(one, drawn[one.name])
            if command == "desim sweep":
                parts += _study(one, docs)
            text = (folder() / f"{one.name}.yaml").read_text()
            parts += [f"<details><summary>scenarios/{one.name}.yaml</summary>",
                      f"```yaml\n{text}```", "</details>"]
    return "\n\n".join(parts) + "\n"


def _run(one: Shipped, drawn: Drawn) -> list[str]:
    parts = [f"```{{figure}} pictures/{drawn.picture}\n:width: 100%\n:alt: {one.name}\n\n"
             f"{drawn.caption}\n```"]
    if drawn.replay is not None:
        parts.append(f'<p><a href="../replays/{drawn.replay}">Watch its replay</a></p>')
    return parts


def _study(one: Shipped, docs: Path) -> list[str]:
    """The question at length, and where there is one, the report with its first figure."""
    question = yaml12.read(str(folder() / f"{one.name}.yaml"))[0].get("question")
    parts = [inline(" ".join(question.split()))] if isinstance(question, str) else []
    name = one.name.rpartition("/")[2]
    if (docs / "studies" / f"{name}.md").is_file():
        figures = sorted((docs / "studies" / name).glob("*.png"))
        if figures:
            parts.append(f"![{name}](../docs/studies/{name}/{figures[0].name})")
        parts.append(f"[What it has shown](../docs/studies/{name}.md)")
    return parts
