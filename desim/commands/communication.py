"""The commands about what the hosts of a run said to each other, and believed of each other."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from desim.commands.arguments import RunPath, Trust
from desim.commands.compiling import compiling
from desim.commands.exit_codes import reading
from desim.commands.output import say, say_json
from desim.errors import InputError


def trace(path: RunPath,
          message: Annotated[int | None, typer.Option(
              min=1, show_default=False,
              help="the number of a message between hosts, from 1")] = None,
          topic: Annotated[str | None, typer.Option(
              show_default=False, help="list messages of this topic; * and ? stand for letters")]
          = None,
          dropped: Annotated[bool, typer.Option("--dropped", help="list what was lost")] = False,
          at: Annotated[str | None, typer.Option(
              metavar="TIME", show_default=False,
              help="list what was under way then, e.g. 63s")] = None,
          trust: Trust = False) -> None:
    """The story of one message: every row about it, in order, and where the time went.

    Without a number: a list of messages to choose from.
    """
    with reading(trust):
        at_ns = None if at is None else _instant(at)
        with compiling(False):
            from desim.commands.views.message import message_list, show_story
            from desim.results.run import Run
        if message is None:
            say(message_list(path, topic, dropped, at_ns))
        else:
            from desim.commands.views.terminal import Terminal

            show_story(Run(path, trust), message, Terminal())


def why(path: RunPath,
        topic: Annotated[str | None, typer.Option(
            show_default=False, help="messages of this topic; * and ? stand for letters")] = None,
        source: Annotated[str | None, typer.Option(
            "--from", metavar="HOST", show_default=False, help="messages of this host")] = None,
        to: Annotated[str | None, typer.Option(
            metavar="HOST", show_default=False, help="messages to this host")] = None,
        message: Annotated[int | None, typer.Option(
            min=1, show_default=False, help="the number of one message between hosts")] = None,
        since: Annotated[str | None, typer.Option(
            metavar="TOPIC", show_default=False, help="the age of what their sender had read of "
            "this topic when it computed them, e.g. '/*/scan'")] = None,
        late: Annotated[int, typer.Option(
            min=0, metavar="N", help="show the N latest messages")] = 10,
        dropped: Annotated[bool, typer.Option(
            "--dropped", help="show messages that were lost")] = False,
        as_json: Annotated[bool, typer.Option("--json", help="all of it, as JSON")] = False,
        trust: Trust = False) -> None:
    """The parts of late messages' time: queues, contention, airtime, retransmissions, hops.

    Of lost messages it shows the reason and the place. A run that has not kept its ledger is made
    again, which takes as long as the run.
    """
    with reading(trust):
        with compiling(as_json):
            from desim.commands.views.why import json_object, show
            from desim.results.file_names import SUMMARY
            from desim.results.run import Run
            from desim.results.why import Query, breakdown
        made = Run(path, trust)
        found = breakdown(made.ledger, Query(topic, source, to, message, late, dropped,
                                          since))
        metrics = made.metrics if made.has(SUMMARY) else {}
        if as_json:
            say_json(json_object(found, metrics))
        else:
            from desim.commands.views.terminal import Terminal

            show(found, metrics, Terminal())


def graph(path: RunPath,
          at: Annotated[str | None, typer.Option(
              metavar="TIME", help="the instant, e.g. 63s (default: the end)",
              show_default=False)] = None,
          topic: Annotated[str | None, typer.Option(
              help="matches of this topic only", show_default=False)] = None,
          to: Annotated[Path | None, typer.Option(
              help="draw it into this file, png, pdf or svg", show_default=False)] = None,
          as_json: Annotated[bool, typer.Option("--json", help="all of it, as JSON")] = False,
          trust: Trust = False) -> None:
    """The beliefs of all hosts about each other, beside the truth.

    It shows hosts that are seen online or not, matches of publishers and subscribers that are known
    or missing, and ghosts.
    """
    with reading(trust):
        at_ns = None if at is None else _instant(at)
        with compiling(as_json):
            from desim.commands.views.beliefs import json_object, show
            from desim.results.beliefs import beliefs_at
            from desim.results.run import Run
        if to is not None:
            from desim.report.picture_file import check_ending

            check_ending(to)  # a run may have to be repeated before there is something to draw
        known = beliefs_at(Run(path, trust), at_ns)
        if topic is not None:
            known = known.of(topic)
        if to is not None:
            from desim.report.beliefs_figure import draw

            draw(known, to)
        if as_json:
            say_json(json_object(known))
        elif to is not None:
            say(f"{known.headline}\n{to}")
        else:
            from desim.commands.views.terminal import Terminal

            show(known, Terminal())


def _instant(text: str) -> int:
    """The nanoseconds of ``63s``, ``63 s`` or ``1 min 3 s``."""
    from desim.units import DURATION

    try:
        return sum(map(DURATION.parse, re.split(r"(?<=[a-zµ])\s+(?=[\d.])", text.strip())))
    except ValueError as error:
        raise InputError(f"--at: {error}") from None
