"""A network that is another simulator, with an agenda of its own: ``ports.Federate``."""

from heapq import heappop, heappush

import pytest
from hypothesis import given
from hypothesis import strategies as st
from runs import HELLO, built, outcome_of

from desim import ports
from desim.errors import InputError, KernelError, ModelError
from desim.testing import Bench

SECONDS = "stop.elapsed=3 s"
FRAMES = st.lists(st.tuples(st.integers(0, 5000), st.permutations(range(1, 5)), st.integers(1, 200),
                            st.booleans()), min_size=1, max_size=20)


class Line:
    """Two hops in a row for all frames; every third is lost at the end."""

    reasons = ("lost",)
    Params = ports.Params

    def __init__(self, params=None):
        self.free_ns = [0, 0]

    def start(self, context, hosts):
        self.context = context

    def send(self, frame):
        self.enter(0, frame, self.context.now_ns)

    def enter(self, hop, frame, now_ns):
        self.free_ns[hop] = max(self.free_ns[hop], now_ns) + 10 * frame.size_bytes
        self.book(self.free_ns[hop], hop, frame)

    def left(self, passage):
        hop, frame = passage
        if hop == 0:
            self.enter(1, frame, self.context.now_ns)
        else:
            self.settle(frame)

    def settle(self, frame):
        self.context.settle_many(frame, None, ports.Drop("lost") if frame.id % 3 == 0 else
                                 ports.Deliver(5))


class LineOfDesim(Line):
    def book(self, time_ns, hop, frame):
        self.context.at(time_ns, self.left, (hop, frame))


class LineOfAnother(Line):
    """Its passages are on an agenda of its own, and desim hears of the ends only."""

    def start(self, context, hosts):
        super().start(context, hosts)
        self.agenda = []

    def book(self, time_ns, hop, frame):
        heappush(self.agenda, (time_ns, frame.id, hop, frame))

    def advance(self, to_ns):
        while self.agenda and self.agenda[0][0] <= to_ns:
            now_ns, _, hop, frame = heappop(self.agenda)
            if hop == 1:
                self.context.at(now_ns, self.settle, frame)
                return now_ns
            self.enter(1, frame, now_ns)
        return to_ns


class Rash(LineOfAnother):
    """It does not stop at its first output."""

    def advance(self, to_ns):
        while super().advance(to_ns) < to_ns:
            pass
        return to_ns


def log(model, frames):
    bench = Bench(model)
    for label, (time_ns, (source, *receivers), size_bytes, broadcast) in enumerate(frames):
        receivers = [f"host_{host}" for host in receivers[:3 if broadcast else 1]]
        bench.send(time_ns, f"host_{source}", receivers, size_bytes, label=label,
                   broadcast=broadcast)
    return bench.run()


@given(FRAMES)
def test_frames_meet_the_fates_that_they_meet_with_context_at(frames):
    assert log(LineOfAnother(), frames) == log(LineOfDesim(), frames)


def digest(model):
    return outcome_of(HELLO, f"network.media.lan.model={__name__}:{model.__name__}", SECONDS).digest


def test_a_fleet_does_the_same():
    assert digest(LineOfAnother) == digest(LineOfDesim)


def test_one_that_passes_its_first_output_does_not():
    with pytest.raises((AssertionError, KernelError, ModelError)):
        assert digest(Rash) == digest(LineOfDesim)


def test_a_run_has_one():
    """Neither could know how far it may go."""
    media = "network.media={" + ", ".join(
        f"{name}: {{model: '{__name__}:LineOfAnother'}}" for name in ("lan", "air")) + "}"
    with pytest.raises(InputError, match=(
            r"^network\.media\.\w+: \S+LineOfAnother \S+ and \S+LineOfAnother \S+ would both be in "
            r"lock-step with the run; only one can$")):
        built(HELLO, media)
