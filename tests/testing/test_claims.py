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

    def channels(self, hosts):
        return [f"line {host}" for host in hosts]

    def airtime_ns(self, hosts):
        return [(0, 0)] * len(hosts)

    def links(self):
        return np.array([0, 1]), np.array([1, 0]), np.array([1.0, 0.5])

    def signal(self, from_m, to_m):
        return ports.Signal(np.zeros(len(to_m)), np.ones(len(to_m)))

    def separates(self, host, other):
        return False

    def carrier(self, host):
        return True, None

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
    ("channels", lambda self, hosts: ["line"], "give for channels a name of each channel"),
    ("airtime_ns", lambda self, hosts: [0] * len(hosts),
     "give for airtime_ns whole nanoseconds of sending and of hearing"),
    ("links", lambda self: (np.array([0]), np.array([0]), np.array([1.0])),
     "give for links two hosts and a share"),
    ("links", lambda self: (np.array([0]), np.array([1]), np.array([])), "of one length"),
    ("signal", lambda self, from_m, to_m: ports.Signal(np.zeros(1), np.ones(1)),
     "give for signal a power and a share"),
    ("separates", lambda self, host, other: None, "give a bool for separates"),
    ("carrier", lambda self, host: (True, 0), "give for carrier a bool and a later whole nanosec"),
    ("send", ImmediateNetwork.send, "ask context.judge_transmission about each transmission")])
def test_a_claim_that_is_not_kept_is_seen(name, wrong, advice):
    with pytest.raises(AssertionError, match=advice):
        check_network(type("Claims", (Claims,), {name: wrong}))


class Hurries(Claims):
    """One frame takes a millisecond behind the other, many at once do not."""

    def __init__(self, params):
        self.free_ns = 0

    def send(self, frame):
        self.free_ns = max(self.free_ns, self._context.now_ns) + 1_000_000
        return self.free_ns - self._context.now_ns

    def send_many(self, frames):
        return [self.send(frame) for frame in frames.singly()[:2]]


class Lies:
    """A rule that drops single frames and lets many pass."""

    Params = ports.Params
    reasons = ("odd",)

    def __init__(self, params):
        """There is nothing to set."""

    def start(self, context, hosts):
        """There is nothing to do."""

    def judge(self, frame, receivers):
        return [ports.Drop("odd") if frame.size_bytes % 2 else ports.PASS for _ in receivers]

    def all_pass(self, frames):
        return frames.size_bytes % 2 == 0


@pytest.mark.parametrize("wrong, error, advice", [
    (lambda self, frames: [1_000_000] * len(frames.receivers), AssertionError,
     r"treat many frames \(send_many, all_pass\) as each of them for itself"),
    (lambda self, frames: [  # from the 32nd frame on it is late
        self.send(frame) + (number > 30) for number, frame in enumerate(frames.singly())],
     AssertionError, r"treat many frames .* the first that differ are \(\d+, .* at once, \(\d+,"),
    (lambda self, frames: [0] * (len(frames.receivers) + 1), ModelError,
     r"Hurries .* returned \d+ delays from send_many for \d+ frames"),
    (lambda self, frames: [None], AssertionError,  # it never settles that frame
     r"treat many frames \(send_many, all_pass\) as each of them for itself"),
    (lambda self, frames: [0.5], ModelError, "delivers after 0.5; wanted: an int >= 0"),
    (lambda self, frames: [-3], ModelError, "delivers after -3; wanted: an int >= 0")])
def test_many_frames_at_once_are_treated_as_single_ones(wrong, error, advice):
    check_network(type("Sound", (Hurries,), {"judges_transmissions": False}))
    with pytest.raises(error, match=advice):
        check_network(type("Hurries", (Hurries,), {"judges_transmissions": False,
                                                   "send_many": wrong}))


def test_a_rule_that_lets_many_pass_lets_each_pass():
    check_rule(Lies)
    with pytest.raises(AssertionError, match="treat many frames"):
        check_rule(type("Lies", (Lies,), {"all_pass": lambda self, frames: True}))


def test_a_rule_that_forgets_that_it_drops_later_is_seen():
    def start(self, context, hosts):
        self.context = context

    def judge(self, frame, receivers):
        late = self.context.now_ns > 1_000_000_000
        return [ports.Drop("odd") if late else ports.PASS for _ in receivers]

    forgets = {"start": start, "judge": judge, "all_pass": lambda self, frames: True}
    with pytest.raises(AssertionError, match="treat many frames"):
        check_rule(type("Forgets", (Lies,), forgets))


def test_a_model_that_forgets_how_long_many_frames_take_is_seen():
    def send(self, frame):
        self.sent += 1
        return 1000

    counts = {"sent": 0, "send": send, "judges_transmissions": False,
              "send_many": lambda self, frames: [1000] * len(frames.receivers),
              "busy_ns": lambda self, hosts: [self.sent for _ in hosts]}
    with pytest.raises(AssertionError, match="busy_ns at once and one by one"):
        check_network(type("Forgets", (Hurries,), counts))


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
