"""A ROS 2 node's endpoints on Cyclone DDS, and topics.

    cyclone_node.py MULTICAST NAME BEGIN WORD...

MULTICAST: what it may be used for (spdp, true). BEGIN: seconds until it talks. WORDs: see
peer_words.py.
"""

import os
import sys
import threading

from peer_words import heard, talk, text, topics

multicast, name, begin, *words = sys.argv[1:]
os.environ["CYCLONEDDS_URI"] += (
    ",<CycloneDDS><Domain><General><AllowMulticast>" + multicast
    + "</AllowMulticast></General></Domain></CycloneDDS>")

from cyclonedds.core import Listener, Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import make_idl_struct  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402

TYPE = "nav_msgs.msg.dds_.OccupancyGrid_"
SERVICES = ("GetParameters", "GetParameterTypes", "SetParameters", "SetParametersAtomically",
            "DescribeParameters", "ListParameters")
AROUND_BYTES = 5  # of a string in CDR: its length, and a NUL


def type_of(name):
    """A type of that name, which holds a string."""
    return make_idl_struct("Text", name, {"data": str})


class Hearing(Listener):
    def on_data_available(self, reader):
        while samples := reader.take(N=100):
            for sample in samples:
                heard(sample.data)


class Participant:
    """A participant with the endpoints of ROS 2 itself."""

    def __init__(self):
        self.participant = DomainParticipant(0)
        self.topics, self.kept = {}, []
        info = "ros_discovery_info", "rmw_dds_common.msg.dds_.ParticipantEntitiesInfo_"
        events = "rt/parameter_events", "rcl_interfaces.msg.dds_.ParameterEvent_"
        self.writer(*info, 1, True, latched=True)
        self.reader(*info, 0, True, latched=True)
        self.writer("rt/rosout", "rcl_interfaces.msg.dds_.Log_", 1000, True, latched=True)
        self.writer(*events, 1000, True)
        self.reader(*events, 1000, True)
        for service in SERVICES:
            snake = "".join(f"_{c.lower()}" if c.isupper() else c for c in service)[1:]
            kind = f"rcl_interfaces.srv.dds_.{service}"
            self.reader(f"rq/{name}/{snake}Request", f"{kind}_Request_", 10, True)
            self.writer(f"rr/{name}/{snake}Reply", f"{kind}_Response_", 10, True)

    def writer(self, topic, kind, depth, reliable, latched=False):
        self.kept.append(DataWriter(self.participant, self._topic(topic, kind),
                                    qos=_qos(depth, reliable, latched)))
        return self.kept[-1]

    def reader(self, topic, kind, depth, reliable, latched=False, listener=None):
        self.kept.append(DataReader(self.participant, self._topic(topic, kind),
                                    qos=_qos(depth, reliable, latched), listener=listener))

    def _topic(self, topic, kind):
        if topic not in self.topics:
            self.topics[topic] = Topic(self.participant, topic, type_of(kind))
        return self.topics[topic]


def _qos(depth, reliable, latched):
    policies = [Policy.History.KeepLast(depth) if depth else Policy.History.KeepAll,
                Policy.Reliability.Reliable(duration(milliseconds=100)) if reliable
                else Policy.Reliability.BestEffort]
    return Qos(*policies, *([Policy.Durability.TransientLocal] if latched else []))


node = Participant()
publishes, listens = topics(words)
for topic, size, rate, depth, reliable in publishes:
    writer = node.writer(f"rt{topic}", TYPE, depth, reliable)
    if rate:
        threading.Thread(target=talk, args=(
            float(begin), rate, lambda number, writer=writer, size=size, topic=topic: writer.write(
                node.topics[f"rt{topic}"].data_type(text(number, size - AROUND_BYTES))))).start()
for topic, depth, reliable in listens:
    node.reader(f"rt{topic}", TYPE, depth, reliable, listener=Hearing())
threading.Event().wait()
