"""Waterfalls of messages: where the time of each went, as bars of characters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.text import Text

from desim.ports import TimePart
from desim.results.data_age import DataAge
from desim.results.latency_by_topic import as_json
from desim.results.why import READ, LatencyBreakdown, MessageFate
from desim.results.why_causes import CauseGroup, grouped

_BESIDE = 58  # characters of a line beside its bar
_LEAST, _MOST = 20, 60  # of a bar
_EIGHTHS = " ▏▎▍▌▋▊▉█"
_DROPS = 20  # lines of them
_PARTS = 3  # of a topic
_COLOURS: dict[str, str] = {
    TimePart.SENDER: "yellow", TimePart.RESOLUTION: "magenta", TimePart.QUEUE: "red",
    TimePart.CONTENTION: "bright_red", TimePart.AIRTIME: "green", TimePart.PROPAGATION: "cyan",
    TimePart.RETRANSMISSION: "bright_magenta", TimePart.RULES: "blue", TimePart.MEDIUM: "white",
    TimePart.RELAY: "bright_yellow"}  # of the parts of the latency


def show(found: LatencyBreakdown, metrics: Mapping[str, Any], console: Console) -> None:
    """Print the causes, the shares of the parts and what was lost, and what late maps cost the
    fleet, of the run's ``metrics``; then a waterfall of each cause."""
    causes = grouped(found.messages)
    if causes:
        _print_causes(causes, found, console)
    if not found.messages and not found.dropped:
        _print(console, f"none of {found.delivered} messages that match was dropped")
    if found.times_ns:
        _print_shares(found, console)
    if found.delivered and len(found.by_topic) > 1:
        _print_topics(found, console)
    if found.lost:
        _print_drops(found, console)
    if found.age is not None:
        _print_age(found.age, console)
    if not found.is_itemized:
        _print(console, "on the medium: a network model does not give the parts of its time "
                        "(docs/writing-plugins.md, Itemizes)", style="dim")
    if metrics.get("outdated_goal_m"):
        _print(console, f"{metrics['outdated_goal_m']:.0f} of {metrics['exploration_cost_m']:.0f} "
                        f"m, in {metrics['outdated_goal_s']:.0f} s, robots drove towards places "
                        "that a teammate had explored", style="bold")
    for group in causes:
        _print(console)
        show_message(group.messages[0], console)
        if len(group.messages) > 1:
            _print(console, f"and {len(group.messages) - 1} more: {group.cause}", style="dim")


def _print_causes(causes: Sequence[CauseGroup], found: LatencyBreakdown, console: Console) -> None:
    """A line for each cause of the messages that were chosen."""
    lost = all(message.reason is not None for message in found.messages)
    _print(console, f"{len(found.messages)} of {found.dropped if lost else found.delivered} "
                    f"{'dropped' if lost else 'delivered'} messages that match, by cause",
           style="bold")
    for group in causes:
        first_ns, last_ns = group.born_ns
        born = f"at {first_ns / 1e9:.3f} s" if first_ns == last_ns else (
            f"from {first_ns / 1e9:.3f} s until {last_ns / 1e9:.3f} s")
        least, most = map(duration, group.latency_ns)
        _print(console, f"{len(group.messages):>8}  {group.cause}{_lost_frames(group)}; born {born}"
                        f", {'dropped' if group.messages[0].reason else 'delivered'} after "
                        f"{most if least == most else f'{least} to {most}'}")


def _lost_frames(group: CauseGroup) -> str:
    if group.from_ns is None or group.until_ns is None:
        return ""
    return f" from {group.from_ns / 1e9:.3f} s until {group.until_ns / 1e9:.3f} s"


def show_message(message: MessageFate, console: Console) -> None:
    """Print the waterfall of one message at one receiver, or where and why it was lost."""
    fate = ("delivered" if message.reason is None else
            f"dropped ({message.reason} {in_words(str(message.place))})")
    _print(console, f"message {message.number}, {message.topic}, {message.source} -> "
                    f"{message.destination}, {message.size_bytes} B", style="bold")
    _print_bars([(*part, "") for part in message.before], console)
    _print(console, f"born at {message.born_ns / 1e9:.6f} s, {fate} after "
                    f"{duration(message.latency_ns)}")
    _print_meanwhile(message, console)
    if message.reason is not None:
        return
    lines = [(*part, share(part.time_ns, message.latency_ns)) for part in message.parts]
    if message.waited_ns is not None:
        lines.append((message.waited_in, message.destination, message.waited_ns, ""))
    _print_bars(lines, console)
    if message.waited_ns is None:
        _print(console, f"{READ:<16} {message.destination}: never read by desim")


def _print_meanwhile(message: MessageFate, console: Console) -> None:
    """A line for its wait for an association, and one for frames that were lost meanwhile."""
    wait, lost = message.association, message.frames_lost
    if wait is not None:
        _print(console, f"{wait.host} waited {duration(wait.time_ns)} for association with "
                        f"{wait.access_point}, from {wait.from_ns / 1e9:.6f} s until "
                        f"{wait.until_ns / 1e9:.6f} s")
    if lost is not None and lost.place is not None:
        at = (f"at {lost.from_ns / 1e9:.6f} s" if lost.from_ns == lost.until_ns else
              f"from {lost.from_ns / 1e9:.6f} s until {lost.until_ns / 1e9:.6f} s")
        people = f"; {lost.behind_people} with people between" if lost.behind_people else ""
        _print(console, f"frames between the two hosts were lost meanwhile, most for {lost.reason} "
                        f"{in_words(lost.place)}, {at}{people}")


def in_words(place: str) -> str:
    """The place of a loss: ``on lan at robot_3``, or ``at robot_3`` above all media."""
    return f"on {place}" if " at " in place else f"at {place}"


def _print_shares(found: LatencyBreakdown, console: Console) -> None:
    """The shares of all messages that match, beside those of the messages that were shown."""
    times_ns, shown_ns = found.times_ns, found.messages_times_ns
    total_ns, total_shown_ns = (sum(time_ns for part, time_ns in times.items() if part in _COLOURS)
                                for times in (times_ns, shown_ns))
    _print(console, f"all {found.delivered} delivered messages that match: mean of each part, its "
                    "share, and its share in those above", style="bold")
    _print_bars([(part, share(time_ns, total_ns) if part in _COLOURS else "",
                  time_ns // found.delivered,
                  (share(shown_ns.get(part, 0), total_shown_ns) or "-") if part in _COLOURS else "")
                 for part, time_ns in times_ns.items()], console)


def _print_topics(found: LatencyBreakdown, console: Console) -> None:
    """A line for each family of topics: messages, mean latency, and its greatest parts."""
    _print(console, "by topic: delivered, dropped, mean latency, and the shares of its parts",
           style="bold")
    width = max(map(len, found.by_topic))
    for topic, one in found.by_topic.items():
        if not one.delivered:
            _print(console, f"{topic:<{width}} {0:>8} {one.dropped:>7} {'-':>10}")
            continue
        parts = sorted(one.times_ns.items(), key=lambda item: -item[1])[:_PARTS]
        _print(console, f"{topic:<{width}} {one.delivered:>8} {one.dropped:>7} "
                        f"{duration(one.latency_ns / one.delivered):>10}  "
                        + ", ".join(f"{part} {share(time_ns, one.latency_ns)}"
                                    for part, time_ns in parts))


def _print_age(age: DataAge, console: Console) -> None:
    """The mean age of the data, and what it consists of."""
    if age.messages:
        _print(console, f"since the reading on which they are based: {duration(age.mean_ns)}, mean "
                        f"of {age.messages}, {duration(age.longest_ns)} at most", style="bold")
    for part, time_ns in age.parts_ns.items():
        _print(console, f"{part:<16} {duration(time_ns):>10} "
                        f"{share(round(time_ns), round(age.mean_ns)):>7}")
    if age.blind:
        _print(console, f"{age.blind} messages whose sender had read nothing of that topic")


def _print_drops(found: LatencyBreakdown, console: Console) -> None:
    _print(console, f"{found.dropped} dropped messages that match", style="bold")
    for reason, place, count in found.lost[:_DROPS]:
        _print(console, f"{count:>8}  {reason:<16} {in_words(place)}")
    if len(found.lost) > _DROPS:
        rest = sum(lost.messages for lost in found.lost[_DROPS:])
        _print(console, f"{rest:>8}  at other places")


def _print_bars(lines: Iterable[tuple[str, str, int, str]], console: Console) -> None:
    """A line for each part: its name, place, time (ns) and a word behind it. The bars are those of
    the latency, to which what is before the birth and behind the arrival does not belong."""
    lines = list(lines)
    width = min(max(console.width - _BESIDE, _LEAST), _MOST)
    begin_ns, whole_ns = 0, sum(time_ns for part, _, time_ns, _ in lines if part in _COLOURS)
    for part, place, time_ns, last in lines:
        drawn = bar(begin_ns, time_ns, whole_ns, width) if part in _COLOURS else ""
        begin_ns += time_ns if part in _COLOURS else 0
        console.print(Text.assemble(
            f"{part:<16} {place:<18} ", (f"{drawn:<{width}}", _COLOURS.get(part, "")),
            f" {duration(time_ns):>10} {last:>7}"), soft_wrap=True)


def _print(console: Console, text: str = "", style: str = "") -> None:
    console.print(Text(text, style=style), soft_wrap=True, highlight=False)


def bar(begin_ns: int, time_ns: int, whole_ns: int, width: int) -> str:
    """A bar from ``begin_ns`` on in a row of ``width`` characters for ``whole_ns``, to an eighth of
    a character, and never empty."""
    if whole_ns <= 0:
        return ""
    first = begin_ns * width // whole_ns
    end = max(8 * width * (begin_ns + time_ns) // whole_ns, 8 * first + 1)
    full, eighths = divmod(end - 8 * first, 8)
    return " " * first + "█" * full + _EIGHTHS[eighths].strip()


def share(time_ns: int, whole_ns: int) -> str:
    """A share for readers; empty where there is nothing to share."""
    return f"{100 * time_ns / whole_ns:.1f} %" if whole_ns else ""


def duration(time_ns: float) -> str:
    """A time for readers, with three digits or more: ns, us, ms or s."""
    for unit, size in (("s", 1e9), ("ms", 1e6), ("us", 1e3)):
        if time_ns >= size:
            return f"{time_ns / size:.3f} {unit}"
    return f"{time_ns:.0f} ns"


def json_object(found: LatencyBreakdown, metrics: Mapping[str, Any]) -> Mapping[str, object]:
    """The breakdown as an object for ``--json``."""
    return {
        "causes": [{"cause": group.cause, "messages": len(group.messages),
                    "from_ns": group.from_ns, "until_ns": group.until_ns,
                    "born_ns": group.born_ns, "latency_ns": group.latency_ns}
                   for group in grouped(found.messages)],
        **{name: metrics.get(name) for name in ("outdated_goal_s", "outdated_goal_m")},
        "messages": [{**message._asdict(), **{
            name: [part._asdict() for part in getattr(message, name)] for name in
            ("before", "parts")},
            "association": message.association and message.association._asdict()}
                     for message in found.messages],
        "delivered": found.delivered, "dropped": found.dropped,
        "shares_ns": found.times_ns, "shares_of_messages_ns": found.messages_times_ns,
        "lost": [lost._asdict() for lost in found.lost],
        "by_topic": as_json(found.by_topic),
        "age": None if found.age is None else asdict(found.age),
    }
