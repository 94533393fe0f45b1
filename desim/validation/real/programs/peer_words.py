"""The words of the programs of peers, their clock, and how they say what they heard.

A word TOPIC:BYTES:HZ:DEPTH:RELIABLE is a topic to publish, TOPIC:DEPTH:RELIABLE one to read.
"""

import sys
import time

BEGAN = time.time()
NUMBERED = "{} {:.9f} "


def say(what):
    """Print a line in one write: several threads print."""
    sys.stdout.write(f"{what}\n")


def topics(words):
    """The topics to publish, and those to read."""
    parts = [word.split(":") for word in words]
    return ([(topic, int(size), float(rate), int(depth), reliable == "1")
             for topic, size, rate, depth, reliable in (one for one in parts if len(one) == 5)],
            [(topic, int(depth), reliable == "1")
             for topic, depth, reliable in (one for one in parts if len(one) == 3)])


def text(number, size):
    """A message of ``size`` bytes: its number, when it was made, and filling."""
    return NUMBERED.format(number, time.time()).ljust(size, "x")


def heard(message):
    """Say that such a message has come."""
    number, born = message[:64].split(" ", 2)[:2]
    say(f"heard {number} {time.time():.9f} {born}")


def talk(begin, rate, publish):
    """Call ``publish(number)`` at this rate, from ``begin`` seconds after the start on."""
    first = max(BEGAN + begin, time.time())
    number = 0
    while True:
        time.sleep(max(first + number / rate - time.time(), 0))
        publish(number)
        number += 1


say(f"began {BEGAN:.9f}")
