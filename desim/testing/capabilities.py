"""Checks of the capabilities that a network model or a rule claims."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from desim import ports
from desim.testing.advice import PluginClass, need
from desim.testing.medium_bench import Bench, Fate


class Retrying:
    """A network model whose MAC sends each packet once, if no rule drops it."""

    Params = ports.Params
    reasons = ()
    judges_transmissions = True

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context

    def send(self, frame: ports.Frame) -> None:
        judge = self._context.judge_transmission
        for receiver in frame.receivers:
            packet = frame._replace(receivers=(receiver,), segments=1)
            self._context.settle(frame, receiver, (judge and judge(packet, receiver))
                                 or ports.Deliver(0))


class Asked:
    """A rule that counts the transmissions that it is asked about."""

    Params = ports.Params
    reasons = ()
    per_transmission = True
    times = 0

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        """There is nothing to do."""

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> None:
        self.times += 1


def check_claims(cls: PluginClass[object], bench: Bench) -> None:
    """Check what a model says of itself after it was played on ``bench``."""
    model, now_ns = bench.medium.model, bench.kernel.now_ns
    if isinstance(model, ports.CountsAttempts):
        need(_counts(counts := model.attempts()), cls,
             f"count transmissions, and those without a reply: (int, int), not {counts!r}")
    if isinstance(model, ports.CountsControl):
        need(_counts(counts := model.control()), cls,
             f"count frames and bytes of its protocols: (int, int), not {counts!r}")
    if isinstance(model, ports.CountsBusyTime):
        busy = list(model.busy_ns(range(len(bench.hosts))))
        need(busy and all(isinstance(one, int | np.integer) and 0 <= one <= now_ns
                          for one in busy), cls,
             f"give for busy_ns whole nanoseconds up to now ({now_ns}), not {busy!r}")
    if isinstance(model, ports.NamesChannels):
        names = list(model.channels(range(len(bench.hosts))))
        need(isinstance(model, ports.CountsBusyTime) and len(names) == len(busy), cls,
             f"give for channels a name of each channel of busy_ns, not {names!r}")
    if isinstance(model, ports.CountsAirtime):
        air = list(model.airtime_ns(range(len(bench.hosts))))
        need(len(air) == len(bench.hosts) and all(
            isinstance(pair, tuple) and _counts(pair) and sum(pair) <= now_ns for pair in air), cls,
             "give for airtime_ns whole nanoseconds of sending and of hearing for each host, "
             f"together up to now ({now_ns}), not {air!r}")
    if isinstance(model, ports.KnowsLinks):
        _check_links(cls, model.links(), len(bench.hosts))
    if isinstance(model, ports.PredictsSignal):
        places = bench.medium.positions(now_ns)[:3]
        power_dbm, delivery = model.signal(places[0], places)
        need(len(power_dbm) == len(delivery) == 3 and all(0.0 <= one <= 1.0 for one in delivery),
             cls, "give for signal a power and a share from 0 to 1 for each place, not "
                  f"{power_dbm!r} and {delivery!r}")
    for part in (model, *bench.medium.rules):
        if isinstance(part, ports.Separates):
            answer: object = part.separates(0, 1)
            need(isinstance(answer, bool | np.bool_), cls,
                 f"give a bool for separates, not {answer!r}")
        if isinstance(part, ports.CutsCarrier):
            _check_carrier(cls, part.carrier(0), now_ns)


def _check_carrier(cls: PluginClass[object], carrier: object, now_ns: int) -> None:
    is_pair = isinstance(carrier, tuple) and len(carrier) == 2
    up, at_ns = carrier if isinstance(carrier, tuple) and is_pair else (None, None)
    need(isinstance(up, bool | np.bool_) and (at_ns is None or type(at_ns) is int
                                              and at_ns > now_ns), cls,
         f"give for carrier a bool and a later whole nanosecond than now ({now_ns}), or None, not "
         f"{carrier!r}")


def check_switching(cls: PluginClass[object], bench: Bench,
                    play: Callable[[Bench], object]) -> None:
    """Check that a model that follows hosts settles every frame when one stops and starts."""
    if not isinstance(bench.medium.model, ports.FollowsHosts):
        return
    for time_ns, up in (500_000_000, False), (1_000_000_000, True):
        bench.book(time_ns, lambda up: bench.medium.switched(1, up), up)
    play(bench)
    need(not bench.medium.in_flight(), cls, "settle every frame at every receiver, also when a "
                                            "host stops and starts (switched)")


def check_parts(cls: PluginClass[object], bench: Bench,
                play: Callable[[Bench], list[Fate]], fates: list[Fate]) -> None:
    """Check that a model that itemizes does the same as without a ledger (``fates``), and tells
    parts that sum up to the time that each frame took."""
    if not isinstance(bench.medium.model, ports.Itemizes):
        return
    need(play(bench) == fates, cls, "do the same with a ledger as without one (itemize)")
    for label, source, receiver, took_ns, stamps in bench.spent:
        parts_ns = sum(stamp.time_ns for stamp in stamps)
        need(all(stamp.time_ns > 0 for stamp in stamps) and parts_ns == took_ns, cls,
             f"tell parts that sum up (itemize): frame {label} from {source} to {receiver} took "
             f"{took_ns} ns, its parts are "
             f"{', '.join(f'{stamp.part} {stamp.time_ns}' for stamp in stamps)}: {parts_ns} ns")


def check_transmissions(cls: PluginClass[object], make: Callable[[Sequence[ports.Rule]], Bench],
                        play: Callable[[Bench], object]) -> None:
    """Check that a model that retransmits asks rules about transmissions."""
    asked = Asked()
    bench = make([asked])
    if isinstance(bench.medium.model, ports.Retransmits) and bench.medium.judge_transmission:
        play(bench)
        need(asked.times or not bench.medium.delivered, cls,
             "ask context.judge_transmission about each transmission (judges_transmissions)")


def _counts(counts: object) -> bool:
    return (isinstance(counts, tuple) and len(counts) == 2
            and all(type(one) is int and one >= 0 for one in counts))


def _check_links(cls: PluginClass[object], links: tuple[np.ndarray, np.ndarray, np.ndarray],
                 hosts: int) -> None:
    sources, hearers, shares = (list(column) for column in links)
    need(len(sources) == len(hearers) == len(shares), cls,
         "give for links three arrays of one length")
    for source, hearer, share in zip(sources, hearers, shares, strict=True):
        need(source != hearer and min(source, hearer) >= 0 and max(source, hearer) < hosts
             and 0.0 < share <= 1.0 and not math.isnan(share), cls,
             "give for links two hosts and a share above 0 and up to 1, not "
             f"{source}, {hearer}, {share}")
