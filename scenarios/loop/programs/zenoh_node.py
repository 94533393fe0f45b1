"""A node of Zenoh, which talks or listens.

``zenoh_node.py talk`` puts 500 bytes 20 times a second; ``listen`` prints when each came and how
long it took.
"""

import os
import sys
import time

import zenoh


def heard(sample):
    """Print what arrives."""
    number, born = bytes(sample.payload).split()[:2]
    now = time.time()
    print(f"{number.decode()} {now:.6f} {1e3 * (now - float(born)):.3f} ms", flush=True)


config = zenoh.Config()
config.insert_json5("listen/endpoints", f'["tcp/{os.environ["DESIM_IP"]}:7447"]')  # else IPv6
session = zenoh.open(config)
if sys.argv[1] == "listen":
    subscriber = session.declare_subscriber("chatter", heard)
    time.sleep(1e6)
publisher = session.declare_publisher("chatter")
begin, number = time.monotonic(), 0
while True:
    number += 1
    publisher.put(f"{number} {time.time():.6f} ".ljust(500, "x"))
    time.sleep(max(0.0, begin + number / 20 - time.monotonic()))
