"""A running simulation for Foxglove: the topics of ``desim export --mcap``, over a WebSocket."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import foxglove

from desim.errors import InputError
from desim.export.ros.laser_scans import Scanner
from desim.export.ros.message_types import RosTypes
from desim.export.ros.topics import topic_messages
from desim.report.live.feed import Sink
from desim.report.live.stretch import Stretch
from desim.results.recording import LinkChange
from desim.scenario.schema.scenario import Scenario

_HOST = "127.0.0.1"
PORT = 8765  # which Foxglove proposes


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
    """A run of ``scenario`` for Foxglove. Raises ``InputError`` for a ``port`` that is taken."""
    context = foxglove.Context()
    try:
        server = foxglove.start_server(name=scenario.name, host=_HOST, port=port, context=context)
    except (OSError, RuntimeError) as error:
        raise InputError(f"--foxglove: port {port} cannot be used: {error}") from None
    try:
        yield Channels(scenario, context), f"ws://{_HOST}:{server.port}"
    finally:
        server.stop()
