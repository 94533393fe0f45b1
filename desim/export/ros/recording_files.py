"""Recordings for ROS tools: MCAP files with messages of ROS 2, and bags of ROS 1."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import lz4.frame
import yaml
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as BagWriter

from desim.export.ros.foxglove_layout import layout
from desim.export.ros.laser_scans import Scanner
from desim.export.ros.message_types import RosTypes, TopicMessage
from desim.export.ros.rviz_configuration import rviz_configuration
from desim.export.ros.topics import is_latched, topic_messages
from desim.files import target
from desim.results.file_names import SCENARIO
from desim.results.recording import Recording
from desim.results.status import is_imported

Done = Callable[[int, int], object]
Counts = dict[str, int]
FOXGLOVE, RVIZ_1, RVIZ_2 = ".foxglove.json", ".rviz", ".ros2.rviz"  # endings of what lies beside


def write_mcap(recording: Recording, path: Path, done: Done) -> Counts:
    """Write ``recording`` into an MCAP file with messages of ROS 2 (CDR); beside it a layout for
    Foxglove (``path`` with the ending .foxglove.json) and a configuration for rviz 2
    (.ros2.rviz). The run's resolved scenario is attached, unless it was imported.
    ``done(now_ns, end_ns)`` is called as it goes on.

    Returns the number of messages by topic. Raises ``InputError`` for a damaged run, and for files
    that cannot be written.
    """
    types, counts, manifest = RosTypes(2), Counts(), recording.run.manifest
    with target(path, "--mcap") as beside, beside.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2", library=f"desim {manifest['desim_version']}")
        schemas: dict[str, int] = {}
        channels: dict[str, int] = {}
        writer.add_metadata("desim", {key: str(manifest[key]) for key in (
            "name", "seed", "run_id", "status", "digest")})
        for message in _counted(recording, types, counts, done):
            topic, kind = message.topic, message.kind
            if kind not in schemas:
                schemas[kind] = writer.register_schema(kind, "ros2msg",
                                                       types.definition(kind).encode())
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "cdr", schemas[kind],
                                                          _offered(topic))
            writer.add_message(channels[topic], message.time_ns, types.data(kind, message.message),
                               message.time_ns, counts[topic])
        if not is_imported(recording.run.manifest):
            writer.add_attachment(0, 0, SCENARIO, "application/yaml",
                                  recording.run.content(SCENARIO))
        writer.finish()
    with target(path.with_suffix(FOXGLOVE), "--mcap") as beside:
        beside.write_text(json.dumps(layout(recording), indent=1) + "\n", "utf-8")
    with target(path.with_suffix(RVIZ_2), "--mcap") as beside:
        beside.write_text(rviz_configuration(recording, 2), "utf-8")
    return counts


def _offered(topic: str) -> dict[str, str]:
    """The quality of service with which ``ros2 bag play`` publishes a topic: reliable, and
    transient local where it is latched (rmw: 1 and 1, volatile is 2); a listener to ``/tf_static``
    hears no other."""
    never = {"sec": 9223372036, "nsec": 854775807}
    return {"offered_qos_profiles": yaml.safe_dump([{
        "history": 1, "depth": 1 if is_latched(topic) else 10, "reliability": 1,
        "durability": 1 if is_latched(topic) else 2, "deadline": never, "lifespan": never,
        "liveliness": 1, "liveliness_lease_duration": never,
        "avoid_ros_namespace_conventions": False}], sort_keys=False)}


def write_bag(recording: Recording, path: Path, done: Done) -> Counts:
    """Write ``recording`` into a bag of ROS 1 (version 2.0, LZ4), with the same topics, and a
    configuration for rviz beside it (.rviz). Else as ``write_mcap``."""
    types, counts = RosTypes(1), Counts()
    with target(path, "--bag") as beside:
        writer = BagWriter(beside)
        writer.set_compression(BagWriter.CompressionFormat.LZ4)
        # ROS's own reader (roslz4) takes no other frames: not those that rosbags makes by itself.
        writer.compressor = partial(lz4.frame.compress, block_linked=False, content_checksum=True,
                                    store_size=False)
        connections = {}
        with writer:
            for message in _counted(recording, types, counts, done):
                topic, kind = message.topic, message.kind
                if topic not in connections:
                    connections[topic] = writer.add_connection(
                        topic, kind, typestore=types.store, latching=int(is_latched(topic)))
                writer.write(connections[topic], message.time_ns, types.data(kind, message.message))
    with target(path.with_suffix(RVIZ_1), "--bag") as beside:
        beside.write_text(rviz_configuration(recording, 1), "utf-8")
    return counts


def _counted(recording: Recording, types: RosTypes, counts: Counts, done: Done
             ) -> Iterator[TopicMessage]:
    """All messages; ``counts`` are those so far, this one among them."""
    scanner = None if is_imported(recording.run.manifest) else Scanner(
        recording.run.scenario)
    for number, message in enumerate(topic_messages(recording, types, scanner)):
        counts[message.topic] = counts.get(message.topic, 0) + 1
        if number % 1000 == 0:
            done(message.time_ns, recording.end_ns)
        yield message
