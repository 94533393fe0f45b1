"""A capture of a medium: the packets that are put on it while a run is made once more."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count
from pathlib import Path
from typing import Never

from desim.errors import InputError, did_you_mean
from desim.export.pcap.capture_file import PcapWriter
from desim.export.pcap.packet_headers import (
    ACK,
    FIN,
    PUSH,
    RST,
    SYN,
    CapturedPacket,
    Radiotap,
    Segment,
)
from desim.files import target
from desim.middleware.headers import SEGMENT_HEADER_BYTES
from desim.middleware.tcp import end
from desim.middleware.tcp.receiver import Receiver
from desim.middleware.tcp.sender import Sender
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.network.taps import tap
from desim.ports import Frame, packet_sizes
from desim.results.run import Run
from desim.results.traces import refuse_failed, repeatable
from desim.scenario.schema.communication import PluginChoice
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S, airtime_ns

_FIRST_PORT, _PORTS = 49152, 16384  # dynamic ports (RFC 6335): no protocol is expected there
# Frequencies and radiotap's words for channels: 5 GHz or 2.4 GHz, OFDM or CCK.
_BANDS = {"11a": (5000, 0x0140), "11b": (2407, 0x00A0), "11g": (2407, 0x00C0)}
_FLAGS = {end.SYN: SYN, end.SYN_ACK: SYN | ACK, end.ACK: ACK, end.RESET: RST | ACK,
          end.PROBE: ACK, end.ALIVE: ACK}


def write_pcap(run: Run, medium: str, path: Path, done: Callable[[int, int], object]) -> int:
    """Make ``run`` once more and write each packet that is put on ``medium`` into ``path``, which
    ends where the run did. ``done(now_ns, end_ns)`` is called as it goes on.

    A packet's time is when its sender gives it to its interface; the packets of a train follow each
    other at the medium's rate, or are all at one time where it has none. A capture has what rules
    let through to at least one receiver; it has no repetitions by a radio's MAC, none of its
    acknowledgements, and no frames of routing protocols.

    Returns the number of packets. Raises ``InputError`` for a medium that there is not, a run that
    failed or cannot be repeated, and a file that cannot be written.
    """
    refuse_failed(run)
    media = run.scenario.network.media
    if medium not in media:
        raise InputError(f"--medium: {run.path} has no medium {medium!r}"
                         f"{did_you_mean(medium, media)}; allowed: {', '.join(media)}")
    if media[medium].inside:
        raise InputError(f"--medium: {medium} is inside hosts; allowed: a medium between hosts")
    scenario = repeatable(run, "packets")
    end_ns = round(run.manifest["simulated_s"] * NS_PER_S)
    with target(path, "--pcap") as beside:
        simulation = Simulation(scenario)
        with beside.open("wb") as file:
            tapped = next(one for one in simulation.graph.media if one.name == medium)
            tap = _Tap(tapped, scenario.network.media[medium], PcapWriter(
                file, _radio(scenario.network.media[medium])),
                lambda now_ns: done(now_ns, end_ns))
            simulation.run(end_ns)
            tap.close()
    return tap.packets


def _radio(choice: PluginChoice) -> Radiotap | None:
    """The radio of a medium of 802.11; None: its packets are shown as those of Ethernet, which they
    are to desim."""
    params = choice.params
    standard, channel = getattr(params, "standard", None), getattr(params, "channel", None)
    if standard not in _BANDS or channel is None:
        return None
    first_mhz, kind = _BANDS[standard]
    learns = getattr(params, "rate_control", None) is not None
    return Radiotap(first_mhz + 5 * channel, kind,
                    None if learns else getattr(params, "rate_bps", None),
                    getattr(params, "broadcast_rate_bps", None))


class _Tap:
    """Gives the packets of a medium to ``writer`` in the order of their times."""

    def __init__(self, medium: Medium, choice: PluginChoice, writer: PcapWriter,
                 done: Callable[[int], object]) -> None:
        self.packets = 0
        self._medium, self._writer, self._done = medium, writer, done
        self._rate_bps: int | None = getattr(choice.params, "rate_bps", None)
        self._waiting: list[tuple[int, int, CapturedPacket]] = []  # a heap, as they came
        self._number = count()
        self._sent: dict[int, int] = {}  # packets, by host
        self._ports: dict[tuple[object, int, int], tuple[int, int]] = {}
        # Bytes of a stream so far, by source, receiver and ports.
        self._bytes: dict[tuple[int, int, tuple[int, int]], int] = {}
        tap(medium, self.take)

    def take(self, frame: Frame, carrier: Carrier[Never], token: object) -> None:
        """A frame is put on the medium."""
        now_ns = self._medium.now_ns
        self._write_until(now_ns)
        receiver = frame.receivers[0]
        ports = self._ports_of(frame, receiver, carrier)
        segment = Segment(0, 0, 0)
        if carrier.protocol == "tcp":
            segment = _segment(carrier, token) or Segment(1 + self._bytes.get(
                (frame.source, receiver, ports), 0), 1, ACK | PUSH)
        time_ns, number = now_ns, self._sent.get(frame.source, 0)
        seq, ack, flags = segment
        last = number + frame.segments - 1
        for size_bytes in packet_sizes(frame.size_bytes, frame.segments):
            heappush(self._waiting, (time_ns, next(self._number), CapturedPacket(
                time_ns, frame.source, receiver, frame.broadcast, size_bytes, carrier.protocol,
                ports, Segment(seq, ack, flags if number == last else flags & ~FIN), number)))
            seq += max(0, size_bytes - SEGMENT_HEADER_BYTES)
            number += 1
            if self._rate_bps is not None:
                time_ns += airtime_ns(size_bytes, self._rate_bps)
        self._sent[frame.source] = number
        self._bytes[frame.source, receiver, ports] = seq - 1

    def close(self) -> None:
        """Write what is left."""
        self._write_until(None)

    def _write_until(self, time_ns: int | None) -> None:
        """Write the packets before ``time_ns``; None: all."""
        waiting = self._waiting
        while waiting and (time_ns is None or waiting[0][0] < time_ns):
            self._writer.write(heappop(waiting)[2])
            self.packets += 1
            if self.packets % 1000 == 0:
                self._done(self._medium.now_ns)

    def _ports_of(self, frame: Frame, receiver: int, carrier: Carrier[Never]) -> tuple[int, int]:
        """The ports at the source and at the destination: two for each conversation of two hosts,
        the first one where it began."""
        about = carrier.conversation
        to = -1 if frame.broadcast else receiver
        known = self._ports.get((about, frame.source, to))
        if known is None:
            first = len(self._ports) % _PORTS
            known = _FIRST_PORT + first, _FIRST_PORT + (first + 1) % _PORTS
            self._ports[about, frame.source, to] = known
            self._ports[about, to, frame.source] = known[::-1]
        return known


def _segment(carrier: Carrier[Never], token: object) -> Segment | None:
    """The numbers of a TCP segment, as far as they are simulated: byte 0 of a stream has the
    sequence number 1. None: no sequence numbers are simulated (``StreamLink``)."""
    match carrier, token:
        case Receiver(), (int(start), int(_), int(ack), int(_), int(_), bool(last), int(_)):
            return Segment(1 + start, 1 + ack, ACK | PUSH | last * FIN)
        case Sender(), (int(ack), int(_), tuple(_), _):
            return Segment(1 + carrier.end.far.sender.snd_nxt, 1 + ack, ACK)
        case end.End(), (int(what), int(_), int(_)):
            ahead = what not in (end.SYN, end.SYN_ACK)
            back = what == end.PROBE  # a keep-alive repeats the last byte's number
            return Segment(ahead * (1 + carrier.sender.snd_nxt) - back,
                           0 if what == end.SYN else 1 + carrier.receiver.rcv_nxt, _FLAGS[what])
    return None
