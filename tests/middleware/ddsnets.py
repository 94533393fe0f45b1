"""DDS for small networks, and rules that make trouble there."""

from configured import configured

from desim.middleware.dds.dds import Dds
from desim.ports import PASS, Drop
from netmodels.rules.partition import Partition


def dds(preset="cyclonedds", **params):
    return Dds(configured(Dds.Params, preset=preset, **{"start_spread": "0 ns", **params}))


def partition(start, until):
    return Partition(Partition.Params(groups=[["b"]], **{"from": start, "until": until}))


class Nth:
    """Drops the frames of the given numbers, counted from 1 among those of given ``sizes``."""

    reasons = ("unlucky",)

    def __init__(self, numbers, sizes):
        self._numbers, self._sizes, self._count = numbers, sizes, 0

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        if frame.size_bytes not in self._sizes:
            return None
        self._count += 1
        return [Drop("unlucky") if self._count in self._numbers else PASS for _ in receivers]


def conserved(net, topic="/talk"):
    """Whether each reception has one fate, or is under way."""
    counts = net.counts(topic)
    return counts.intended == counts.delivered + sum(counts.dropped.values()) + net.waiting()
