"""Map sharing that breaks its contract, for tests: each at its first tick."""

import math
from typing import NamedTuple

from desim import ports
from desim.ports.sharing import Contribution
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


class News(Ticking):
    """Takes in its ``news`` each second."""

    def tick(self, context):
        context.take_in(self.news(context, context.team[0], context.now_ns))


class Numbers(News):
    def news(self, *_):
        return [1]


class Nothing(News):
    def news(self, *_):
        return None


class Ghost(News):
    def news(self, context, other, now_ns):
        return [Contribution("ghost", now_ns, None, context.own())]


class Own(News):
    def news(self, context, other, now_ns):
        return [Contribution(context.name, now_ns, None, context.own())]


class ToCome(News):
    def news(self, context, other, now_ns):
        return [Contribution(other, 10**18, None, context.own())]


class Late(News):
    def news(self, context, other, now_ns):
        return [Contribution(other, 0.5, None, context.own())]


class Lost(News):
    def news(self, context, other, now_ns):
        return [Contribution(other, now_ns, ports.Pose2D(math.nan, 0.0, 0.0), None)]


class Flat(News):
    def news(self, context, other, now_ns):
        return [Contribution(other, now_ns, None, context.drawn([[1, 2]]))]


class Framed(Ticking):
    def tick(self, context):
        context.place(context.team[0], (1.0, 2.0, 3.0))
