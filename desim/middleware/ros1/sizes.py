"""The bytes of discovery in ROS 1, without TCP/IP.

They are XML-RPC calls with their HTTP headers, and TCPROS connection headers. Counted for names
like ``/p3dx0/slam_gmapping`` and IPv4 addresses; other names make them up to 15 % longer or
shorter. The bytes of each address in a list are the difference of two such counts.
"""

from __future__ import annotations

from typing import NamedTuple


class Sizes(NamedTuple):
    """The bytes of a call and of its answer, each with the bytes that every address in it adds."""

    call: int
    call_each: int
    answer: int
    answer_each: int


CALLS = {
    # The five that a roscpp subscription asks for, /enable_statistics and /statistics_window_...:
    # 311 to 324 and 390 to 403 B.
    "hasParam": Sizes(320, 0, 399, 0),
    # 442 B of answer without subscribers, 906 B with eight.
    "registerPublisher": Sizes(422, 0, 442, 58),
    # 465 B of answer with one publisher.
    "registerSubscriber": Sizes(424, 0, 407, 58),
    # 515 B with one publisher, 905 B with eight.
    "publisherUpdate": Sizes(459, 56, 289, 0),
    # 3585 B with the 20 topics of one robot, 25 916 B with eight, 96 556 B with thirty.
    "getPublishedTopics": Sizes(306, 0, 385, 160),
    # rospy asks a publisher. 393 B of answer without topics, 1538 B with eight.
    "getPublications": Sizes(321, 0, 393, 143),
    # The master tells a node that another one has taken its name; estimated from the others.
    "shutdown": Sizes(400, 0, 289, 0),
    # Several registrations at once, always within a host: no bytes on any medium.
    "multicall": Sizes(0, 0, 0, 0),
}
REQUEST_TOPIC = {"roscpp": Sizes(434, 0, 383, 0), "rospy": Sizes(434, 0, 519, 0)}

# TCPROS: the subscriber's topic, md5sum, callerid, type and tcp_nodelay; the publisher's answer
# is mostly the message definition (2.2 to 2.3 kB for LaserScan and OccupancyGrid).
HEADER = 149
HEADER_ANSWER = 2250
