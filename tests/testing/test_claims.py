"""The kit checks each capability that a plug-in claims."""

import numpy as np
import pytest

from desim import ports
from desim.errors import ModelError
from desim.testing import ImmediateNetwork, check_network, check_rule


class Claims(ImmediateNetwork):
    """A model that claims everything."""

    judges_transmissions = True

    def attempts(self):
        return 3, 1

    def control(self):
        return 2, 120

    def busy_ns(self, hosts):
        return [0] * len(hosts)

    def links(self):
        return np.array([0, 1]), np.array([1, 0]), np.array([1.0, 0.5])

    def signal(self, from_m, to_m):
        return ports.Signal(np.zeros(len(to_m)), np.ones(len(to_m)))

    def separates(self, host, other):
        return False

    def switched(self, host, up):
        self.up = up

    def __init__(self, params):
        """There is nothing to set."""

    def send(self, frame):
        judge = self._context.judge_transmission
        for receiver in frame.receivers:
            packet = frame._replace(segments=1, receivers=(receiver,))
            self._context.settle(frame, receiver, (judge and judge(packet, receiver))
                                 or ports.Deliver(0))


def test_claims_that_are_kept_pass():
    check_network(Claims)


@pytest.mark.parametrize("name, wrong, advice", [
    ("attempts", lambda self: (1, -2), "count transmissions, and those without a reply"),
    ("control", lambda self: 7, "count frames and bytes of its protocols"),
    ("busy_ns", lambda self, hosts: [-1], "give for busy_ns whole nanoseconds"),
    ("links", lambda self: (np.array([0]), np.array([0]), np.array([1.0])),
     "give for links two hosts and a share"),
    ("links", lambda self: (np.array([0]), np.array([1]), np.array([])), "of one length"),
    ("signal", lambda self, from_m, to_m: ports.Signal(np.zeros(1), np.ones(1)),
     "give for signal a power and a share"),
    ("separates", lambda self, host, other: None, "give a bool for separates"),
    ("send", ImmediateNetwork.send, "ask context.judge_transmission about each transmission")])
def test_a_claim_that_is_not_kept_is_seen(name, wrong, advice):
    with pytest.raises(AssertionError, match=advice):
        check_network(type("Claims", (Claims,), {name: wrong}))


def test_a_model_that_forgets_frames_of_hosts_that_stop_is_seen():
    class Forgets(Claims):
        def switched(self, host, up):
            self.up = up

        def send(self, frame):
            if getattr(self, "up", True):
                super().send(frame)

    with pytest.raises(AssertionError, match="also when a host stops and starts"):
        check_network(Forgets)


def test_a_rule_of_transmissions_is_asked_about_them():
    class Chatty:
        Params = ports.Params
        reasons = ("chatty",)
        per_transmission = True

        def __init__(self, params):
            """There is nothing to set."""

        def start(self, context, hosts):
            """There is nothing to do."""

        def judge(self, frame, receivers):
            return [ports.Deliver(1)] * len(receivers)

    with pytest.raises(ModelError, match="of a transmission; wanted: Drop or Pass"):
        check_rule(Chatty)
