"""Strategies that speak, for tests: each keeps a log of what happens to it."""

from desim import ports
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier
from desim.units import NS_PER_S

LOG = []  # (s, host, what)


def note(context, *what):
    LOG.append((round(context.now_ns / NS_PER_S, 3), context.name, *what))


class Chatty:
    """Announces its goals to all, and notes what it hears and what becomes of its goals."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params):
        self.heard = 0

    def on_start(self, context):
        note(context, "start", context.team)
        context.advertise("announced_goal", latch=True)
        context.subscribe("announced_goal", self.on_announced)
        context.every(NS_PER_S, self.on_second)

    def choose(self, context):
        frontier = next(iter(context.frontiers(limit=1)), None)
        if frontier is not None:
            context.publish("announced_goal", {"at": frontier[:2]})
        return frontier

    def on_announced(self, context, message):
        note(context, "announced", message.source, message.topic, type(message.content["at"]))

    def on_second(self, context):
        if context.goal is not None and self.heard == 0:
            self.heard = 1
            note(context, "drives", context.pose is not None)

    def on_goal(self, context, place, end):
        note(context, "ended", str(end))

    def on_teammate(self, context, name, heard):
        note(context, "hears" if heard else "lost", name)


class Central:
    """On a host without a body it sends robots to the frontiers of the merged map; on a robot it
    goes where it is sent, or after ``patience_s`` without word to the nearest frontier."""

    class Params(ports.Params):
        patience_s: float = 10.0

    def __init__(self, params):
        self.patience_ns = int(params.patience_s * NS_PER_S)
        self.last_ns = 0

    def on_start(self, context):
        context.advertise("send")
        context.subscribe("send", self.on_send)

    def choose(self, context):
        if context.now_ns - self.last_ns < self.patience_ns:
            return None
        note(context, "alone")
        return next(iter(context.frontiers(limit=1)), None)

    def on_map(self, context):
        if context.pose is not None:
            return
        sent = {}
        for name, peer in sorted(context.peers.items()):
            frontiers = context.frontiers(limit=3, origin=ports.Place(peer.x_m, peer.y_m))
            free = [one for one in frontiers if one[:2] not in sent.values()]
            if free:
                sent[name] = free[0][:2]
        if sent:
            context.publish("send", sent)

    def on_send(self, context, message):
        place = message.content.get(context.name)
        if place is not None:
            self.last_ns = context.now_ns
            note(context, "sent", context.go(ports.Place(*place)))


class Surveying(NearestFrontier):
    """Explores, and notes its teammates' areas whenever its map has changed."""

    def on_map(self, context):
        note(context, "areas", context.areas())


class Listening:
    """Stands, and notes its links every second."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params):
        """Nothing is kept."""

    def on_start(self, context):
        context.advertise("here")
        context.subscribe("here", lambda *_: None)
        context.every(NS_PER_S, self.on_second)

    def choose(self, context):
        return None

    def on_second(self, context):
        links = context.links()
        for link in links.values():
            assert link.signal_dbm is None or link.signal_dbm < 0.0  # computed now
        note(context, "links", links)
        context.publish("here", None)
