"""The output of ``desim net fleet``: does a network carry the messages of a fleet?"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

Load = Mapping[str, Any]  # of desim.netcases.fleet_load.play, or of one of its topics or media


def verdict(found: Load, enough: float) -> tuple[bool, str]:
    """Whether ``found`` (``desim.netcases.fleet_load.play``) is good enough, and why: ``enough``
    of each topic's messages arrive, and 95 % of those within the time until the next one."""
    topics = found["topics"]
    if not topics:
        return True, "carries: nothing is said between hosts"
    faults = [fault for name, topic in topics.items() for fault in _faults(name, topic, enough)]
    if faults:
        return False, f"does not carry: {'; '.join(faults)}"
    sent, delivered = (sum(topic[key] for topic in topics.values())
                       for key in ("sent", "delivered"))
    slowest = max(topics, key=lambda name: topics[name]["delay_p95_ms"])
    return True, (f"carries: {delivered / sent:.4g} of all messages arrive, 95 % of each topic's "
                  f"within {_ms(topics[slowest]['delay_p95_ms'])} ({slowest})")


def _faults(name: str, topic: Load, enough: float) -> Iterator[str]:
    share = topic["delivery_ratio"]
    if share is None:
        yield f"{name} is not sent: nobody finds its subscribers"
        return
    if share < enough:
        reasons = ", ".join(sorted(topic["lost"], key=topic["lost"].get, reverse=True))
        yield f"{name} loses {1 - share:.1%} ({reasons})"
    if share and topic["delay_p95_ms"] > 1e3 / topic["rate_hz"]:
        yield (f"{name} is late, 95 % within {_ms(topic['delay_p95_ms'])} where the next one comes "
               f"after {_ms(1e3 / topic['rate_hz'])}")


def description(found: Load) -> str:
    """The assumptions, a table of topics and one of media."""
    topics = _aligned(("topic", "from", "to", "Hz", "B", "Mb/s", "arrived", "mean", "95 %", "99 %",
                       "lost"), (_topic_row(*topic) for topic in found["topics"].items()))
    media = _aligned(("medium", "Mb/s", "carried", "busy", "at most", "packets", "lost"),
                     (_medium_row(*medium) for medium in found["media"].items()))
    lines = [f"{found['hosts']} hosts, {found['measured_s']:g} s", *_assumed(found), "", *topics,
             "", *media, ""]
    return "\n".join(line.rstrip() for line in lines)


def _assumed(found: Load) -> Iterator[str]:
    yield ("  robots stand anywhere in the terrain, drawn by the seed" if found["spread"]
           else "  robots stand where they start")
    if any(name.startswith("/map_exchange/") for name in found["topics"]):
        yield (f"  a map update is {found['map_bytes']} B: "
               + ("as given" if found["map_given"] else
                  "the map of the whole terrain (--map: another size)"))
    yield "  all drive, and have a new map to tell each time; there are no faults"
    yield _delays_of(found)
    if found["left_out"]:
        yield f"  left out, for nobody says how often: {', '.join(found['left_out'])}"


def _delays_of(found: Load) -> str:
    """Of which messages the delays are: a network that is full delivers a part of them, late."""
    said = (f"  arrived: until {found['awaited_s']:g} s after these {found['measured_s']:g} s; "
            "delays are of those that arrived")
    shares = [topic["delivery_ratio"] for topic in found["topics"].values()]
    if any(share is not None and share < 0.95 for share in shares):
        return f"{said}; with such losses another --seed may differ widely"
    return said


def _topic_row(name: str, topic: Load) -> tuple[str, ...]:
    return (name, str(topic["senders"]), str(topic["receivers"]), f"{topic['rate_hz']:g}",
            str(topic["size_bytes"]), _mbps(topic["offered_mbps"]),
            _share(topic["delivery_ratio"]),
            *(_ms(topic[f"delay_{key}_ms"]) for key in ("mean", "p95", "p99")),
            _shares(topic["lost"], topic["sent"]))


def _medium_row(name: str, medium: Load) -> tuple[str, ...]:
    busy = medium["utilisation"] or {"mean": None, "max": None}
    return (name, _mbps(medium["offered_mbps"]), _mbps(medium["carried_mbps"]),
            _share(busy["mean"]), _share(busy["max"]), str(medium["packets"]),
            _shares(medium["packets_lost"], medium["packets"]))


def _aligned(header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Iterator[str]:
    """The rows of a table: text in the first and the last column, numbers between them."""
    table = [header, *rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for first, *numbers, last in table:
        yield "  ".join((first.ljust(widths[0]), *(
            number.rjust(width) for number, width in zip(numbers, widths[1:], strict=False)), last))


def _mbps(value: float) -> str:
    return f"{value:.2g}" if 0 < value < 0.001 else f"{value:.3f}"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


def _shares(counts: dict[str, int], of: int) -> str:
    return ", ".join(f"{reason} {count / of:.1%}" for reason, count in counts.items())


def _ms(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.3g} ms" if value < 1000 else f"{value / 1e3:.3g} s"
