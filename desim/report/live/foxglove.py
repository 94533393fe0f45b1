"""A running simulation for Foxglove: the topics of ``desim export --mcap``, over a WebSocket.

The server of the SDK answers every page of the web that asks. So it listens at an address of this
machine that nobody can guess, and a ``LocalServer`` before it passes on who is welcome.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from dataclasses import replace

import foxglove

from desim.errors import InputError
from desim.export.ros.laser_scans import Scanner
from desim.export.ros.message_types import RosTypes
from desim.export.ros.topics import topic_messages
from desim.report.live.feed import Sink
from desim.report.live.policy import HOST, LocalServer, Request, send
from desim.report.live.stretch import Stretch
from desim.results.recording import LinkChange
from desim.scenario.schema.scenario import Scenario

PORT = 8765  # which Foxglove proposes
_SITES = ("https://app.foxglove.dev",)
_BLOCK = 1 << 16


class Channels:
    """Publishes stretches of a run of ``scenario`` in ``context``, with simulated time stamps."""

    def __init__(self, scenario: Scenario, context: foxglove.Context) -> None:
        self._types, self._scanner, self._context = RosTypes(2), Scanner(scenario), context
        self._channels: dict[str, foxglove.Channel] = {}
        self._links: list[LinkChange] = []

    def __call__(self, stretch: Stretch) -> None:
        """Publish all messages of ``stretch``."""
        self._links += stretch.links
        whole = replace(stretch, links=self._links)  # each marker shows all links
        for message in topic_messages(whole, self._types, self._scanner):
            self._channel(message.topic, message.kind).log(
                self._types.data(message.kind, message.message), log_time=message.time_ns)

    def _channel(self, topic: str, kind: str) -> foxglove.Channel:
        if topic not in self._channels:
            schema = foxglove.Schema(name=kind, encoding="ros2msg",
                                     data=self._types.definition(kind).encode())
            self._channels[topic] = foxglove.Channel(topic, schema=schema, message_encoding="cdr",
                                                     context=self._context)
        return self._channels[topic]


@contextmanager
def foxglove_served(scenario: Scenario, port: int = PORT) -> Iterator[tuple[Sink, str]]:
    """A run of ``scenario`` for Foxglove. Raises ``InputError`` for a ``port`` that is taken, and
    where this machine has one loopback address only (Linux has 2^24)."""
    context, hidden = foxglove.Context(), _unguessable()

    async def answer(request: Request, reader: asyncio.StreamReader,
                     writer: asyncio.StreamWriter) -> None:
        there, to_there = await asyncio.open_connection(hidden, server.port)
        try:
            to_there.write(request.head)
            await _either(_passed_on(reader, to_there), _passed_on(there, writer))
        finally:
            to_there.transport.abort()

    front = LocalServer(answer, "--foxglove", port, _SITES)
    try:
        server = foxglove.start_server(name=scenario.name, host=hidden, port=0, context=context)
    except (OSError, RuntimeError) as error:
        raise InputError(f"--foxglove: {hidden} of this machine cannot be used: {error}; it needs "
                         "Linux") from None
    with front:
        try:
            yield Channels(scenario, context), f"ws://{HOST}:{front.port}"
        finally:
            server.stop()  # all its clients have asked: it would wait for ever for one that has not


def _unguessable() -> str:
    """One of Linux's loopback addresses: a page of the web would have to try them all."""
    return ".".join(["127", *(str(1 + secrets.randbelow(254)) for _ in range(3))])


async def _passed_on(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_BLOCK):
        await send(writer, data)


async def _either(*halves: Coroutine[None, None, None]) -> None:
    """Run until the first of them ends."""
    tasks = [asyncio.ensure_future(half) for half in halves]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
