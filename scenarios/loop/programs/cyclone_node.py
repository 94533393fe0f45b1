"""A node of Cyclone DDS, which talks or listens.

``cyclone_node.py talk`` sends 500 bytes 20 times a second, reliably; ``listen`` prints when each
came and how long it took.
"""

import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class String(IdlStruct, typename="std_msgs.msg.dds_.String_"):
    """The type of std_msgs/msg/String, as ROS 2 names it."""

    data: str


class Printer(Listener):
    """Prints what arrives."""

    def on_data_available(self, reader):
        for text in reader.take(N=100):
            number, born = text.data.split()[:2]
            now = time.time()
            print(f"{number} {now:.6f} {1e3 * (now - float(born)):.3f} ms", flush=True)


participant = DomainParticipant(0)
topic = Topic(participant, "rt/chatter", String)
reliable = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(10))
if sys.argv[1] == "listen":
    reader = DataReader(participant, topic, qos=reliable, listener=Printer())
    time.sleep(1e6)
writer = DataWriter(participant, topic, qos=reliable)
begin, number = time.monotonic(), 0
while True:
    number += 1
    writer.write(String(f"{number} {time.time():.6f} ".ljust(500, "x")))
    time.sleep(max(0.0, begin + number / 20 - time.monotonic()))
