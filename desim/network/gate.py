"""What the rules in front of a medium say of a frame, receiver by receiver."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from desim.errors import ModelError, class_of
from desim.network.answers import check_packets, checked_delay, undeclared
from desim.network.carrier import Carrier
from desim.ports import Deliver, Drop, Duplicate, Frame, Pass, Rule, packet_sizes


class Terms(NamedTuple):
    """The terms on which a frame goes to one receiver.

    Rules add ``delay_ns`` to the model's delay, and copies that follow the frame ``copies_ns``
    later. The packets ``lost`` (number to reason) do not arrive; those ``barred`` were lost in
    front of the model, which was given a train without them.
    """

    delay_ns: int
    copies_ns: tuple[int, ...]
    lost: Mapping[int, str]
    barred: tuple[int, ...]

    def losing(self, packets: Iterable[int], reason: str) -> Terms:
        """The same terms without ``packets``. What was lost before keeps its reason."""
        return self._replace(lost=dict.fromkeys(packets, reason) | self.lost)

    def within(self, frame: Frame) -> tuple[Terms, Frame]:
        """The terms and the train that the model is given: ``frame`` without what is lost."""
        sizes = packet_sizes(frame.size_bytes, frame.segments)
        return (self._replace(barred=tuple(sorted(self.lost))),
                frame._replace(size_bytes=frame.size_bytes - sum(sizes[n] for n in self.lost),
                               segments=frame.segments - len(self.lost)))

    def numbers(self, packets: Iterable[int], segments: int) -> list[int]:
        """The numbers in the whole train of ``segments`` of ``packets``, which the model counts
        without those barred."""
        if not self.barred:
            return list(packets)
        given = [number for number in range(segments) if number not in self.barred]
        return [given[number] for number in packets]


PLAIN = Terms(0, (), {}, ())  # where no rule has anything to say and no packet is lost


class Gate:
    """Carries out what rules say. ``count(reason, frames, packets)`` keeps the account of what they
    drop."""

    def __init__(self, count: Callable[[str, int, int], None]) -> None:
        self._count = count

    def obey(self, rule: Rule, verdicts: list[Any], frame: Frame, receivers: tuple[int, ...],
             terms: dict[int, Terms] | None, carrier: Carrier, token: Any) -> dict[int, Terms]:
        """``terms`` of ``receivers`` as ``rule`` changes them, without the receivers at whom it
        drops the frame. Raises ``ModelError`` for what is no verdict."""
        if terms is None:
            terms = dict.fromkeys(receivers, PLAIN)
        if not isinstance(verdicts, Sequence):
            raise ModelError(f"{class_of(rule)} gave {verdicts!r}; wanted: None, or a list of one "
                             "verdict for each receiver")
        if len(verdicts) != len(receivers):
            raise ModelError(f"{class_of(rule)} gave {len(verdicts)} verdicts for "
                             f"{len(receivers)} receivers")
        for receiver, verdict in zip(receivers, verdicts, strict=True):
            if type(verdict) is Deliver:
                own = terms[receiver]
                terms[receiver] = own._replace(
                    delay_ns=own.delay_ns + checked_delay(rule, "delays by", verdict.delay_ns))
            elif type(verdict) is Drop:
                if self._drops(rule, verdict, frame, receiver, terms):
                    carrier.lost(token, receiver, verdict.reason)
            elif type(verdict) is Duplicate:
                own = terms[receiver]
                after_ns = checked_delay(rule, "makes a copy after", verdict.after_ns)
                terms[receiver] = own._replace(copies_ns=(*own.copies_ns, after_ns))
            elif type(verdict) is not Pass:
                raise ModelError(f"{class_of(rule)} gave {verdict!r}, which is no verdict")
        return terms

    def _drops(self, rule: Rule, verdict: Drop, frame: Frame, receiver: int,
               terms: dict[int, Terms]) -> bool:
        """Take what the rule drops at one receiver out of its terms. Returns whether that was all
        that there was left of the frame."""
        if verdict.reason not in rule.reasons:
            raise undeclared(rule, verdict.reason)
        before = terms[receiver]
        lost = frame.segments - len(before.lost)
        if verdict.packets is not None:
            check_packets(rule, verdict.packets, frame.segments)
            terms[receiver] = after = before.losing(verdict.packets, verdict.reason)
            if len(after.lost) < frame.segments:
                self._count(verdict.reason, 0, len(after.lost) - len(before.lost))
                return False
        del terms[receiver]
        self._count(verdict.reason, 1, lost)
        return True
