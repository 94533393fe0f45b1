"""Some frames arrive twice."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import Duration, Ratio
from netmodels.rules.streams import PairStreams


class Duplication:
    """Each packet arrives twice with ``probability``, independently of all others. This is netem's
    ``duplicate``; each ordered pair of hosts draws from its own stream. A train comes twice where
    all its packets do: probability^segments.

    The copy is made behind the medium, as where something on the way repeats what has arrived
    after all: it takes no capacity, and where the original is lost there is none.
    """

    class Params(ports.Params):
        probability: Ratio = Field(description="of one packet at one receiver")
        after_ns: Duration = Field("1 ms", description="from the original to its copy (a few "
                                                       "attempts of a link layer; netem: at once)")

    reasons = ()

    def __init__(self, params: Params) -> None:
        self._probability = params.probability
        self._twice = ports.Duplicate(params.after_ns)

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._streams = PairStreams(context, "duplication", hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        probability = self._probability ** frame.segments
        return [self._twice if self._streams(frame.source, receiver).random() < probability
                else ports.PASS for receiver in receivers]
