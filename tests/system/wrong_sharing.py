"""Map sharing that breaks its contract, for tests: each at its first tick."""

from typing import NamedTuple

from desim import ports
from desim.units import NS_PER_S


class Ticking:
    """Does nothing each second."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params):
        """Nothing is kept."""

    def start(self, context):
        context.advertise()
        context.every(NS_PER_S, self.tick)

    def tick(self, context):
        """Nothing."""


class Content(NamedTuple):
    """A content of any size."""

    size_bytes: object


class Text(Ticking):
    def tick(self, context):
        context.publish("hello")


class Negative(Ticking):
    def tick(self, context):
        context.publish(Content(-4))


class Fraction(Ticking):
    def tick(self, context):
        context.publish(Content(4.5))


class Unadvertised(Ticking):
    def tick(self, context):
        context.publish(Content(4), "more")
