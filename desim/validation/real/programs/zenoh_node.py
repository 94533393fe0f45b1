"""A router or peer of Zenoh with the declarations of a node of rmw_zenoh.

    zenoh_node.py TIMING NAME BEGIN WORD...

TIMING: zenoh or rmw_zenoh, both of routers, or peer. BEGIN: seconds until it talks. WORDs: see
peer_words.py; of a topic with depth 0 a message without room blocks.
"""

import json
import os
import sys
import threading

import zenoh
from peer_words import heard, say, talk, text, topics

TYPE = "nav_msgs::msg::dds_::OccupancyGrid_"
HASH = "RIHS01_" + 64 * "a"
QUALITY = "::,1:,:,:,,"
RMW = {"transport/link/tx/lease": 60000, "transport/link/tx/keep_alive": 2,
       "transport/unicast/open_timeout": 60000, "transport/unicast/accept_timeout": 60000,
       "transport/link/tx/queue/congestion_control/block/wait_before_close": 60000000}

timing, name, begin, *words = sys.argv[1:]
config = zenoh.Config()
for option, value in {
        "mode": "peer" if timing == "peer" else "router",
        "listen/endpoints": [f"tcp/{os.environ['DESIM_IP']}:7447"],
        "transport/shared_memory/enabled": False,  # all hosts are on one machine here
        "scouting/multicast/listen": True, "scouting/multicast/autoconnect": {
            "router": ["router"], "peer": ["router", "peer"], "client": ["router"]},
        **(RMW if timing == "rmw_zenoh" else {})}.items():
    config.insert_json5(option, json.dumps(value))
session = zenoh.open(config)
tokens = session.liveliness()
kept: list[object] = []
node = f"@ros2_lv/0/{str(session.zid()).rjust(32, '0')}/0"
kept.append(tokens.declare_token(f"{node}/0/NN/%/%/node"))


def key(topic):
    return f"0/{topic.lstrip('/')}/{TYPE}/{HASH}"


def token(number, kind, topic):
    kept.append(tokens.declare_token(
        f"{node}/{number}/{kind}/%/%/node/{topic.replace('/', '%')}/{TYPE}/{HASH}/{QUALITY}"))


def put(publisher, size):
    def once(number):
        publisher.put(text(number, size), attachment=bytes(33))  # as long as that of rmw_zenoh
    return once


publishes, listens = topics(words)
for number, (topic, size, rate, depth, _) in enumerate(publishes, 10):
    control = zenoh.CongestionControl.DROP if depth else zenoh.CongestionControl.BLOCK
    publisher = session.declare_publisher(key(topic), congestion_control=control)
    kept.append(publisher)
    token(number, "MP", topic)
    if rate:
        threading.Thread(target=talk, args=(float(begin), rate, put(publisher, size))).start()
for number, (topic, _, _) in enumerate(listens, 50):
    kept.append(session.declare_subscriber(
        key(topic), lambda sample: heard(bytes(sample.payload).decode())))
    token(number, "MS", topic)
say("declared")
threading.Event().wait()
