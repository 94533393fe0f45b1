"""No message and no frame is lost without a reason, and none is faster than its medium."""

from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from runs import HELLO, ROUGH, Tally, built, finished

from desim.units import NS_PER_S

AIR = "network.media.air"
LAN = "network.media.lan"
CASES = {
    "testbed, switch": (HELLO,),
    "field, disk": (HELLO, "deployment=field", f"{AIR}={{model: disk}}"),
    "field": (HELLO, "deployment=field"),
    "everything at once": (ROUGH,),
    "everything at once, testbed": (
        ROUGH, "deployment=testbed", "faults.0.host=workstation", "faults.2.at=14 s",
        "stop.elapsed=15 s", f"{AIR}.rate=100 Mb/s", f"{AIR}.range=200 m"),
    "a link too small": (
        HELLO, f"{LAN}={{model: link, rate: 12 Mb/s, latency: 3 ms, queue: 30 kB}}"),
    "a switch too small": (
        HELLO, f"{LAN}={{model: switch, rate: 5 Mb/s, buffer: 3 kB, propagation: 1 ms}}",
        "testbed.robots_per_node=2", "coordination.exchange.period=200 ms", "stop.elapsed=15 s"),
    "packet by packet": (
        HELLO, f"{LAN}={{model: packet_by_packet:PacketByPacket, rate: 5 Mb/s, buffer: 3 kB}}",
        "testbed.robots_per_node=1", "coordination.exchange.period=200 ms", "stop.elapsed=15 s"),
    "no network in the way": (
        HELLO, f"{LAN}={{model: ideal, delay: 7 ms}}"),
    "broadcast": (
        HELLO, "deployment=field", "coordination.exchange={via: broadcast, period: 300 ms}",
        f"{AIR}={{model: disk, range: 6 m, rate: 1 Mb/s, "
        "rules: [{rule: loss, probability: 5 %}]}"),
    "broadcast over a switch": (
        HELLO, "coordination.exchange={via: broadcast, period: 300 ms}",
        f"{LAN}={{model: switch, rate: 50 Mb/s}}", "testbed.robots_per_node=2"),
    "radio": (
        HELLO, "deployment=field",
        "network.media={lan: null, air: {model: netmodels.radio.dcf.radio:DcfRadio, queue: 20, "
        "power: -22 dBm}}"),
    "broadcast over radio": (
        HELLO, "deployment=field",
        "coordination.exchange={via: broadcast, period: 100 ms, encoding: raw, content: full}",
        "network.media={lan: null, air: {model: netmodels.radio.dcf.radio:DcfRadio, "
        "power: -12 dBm, broadcast_rate: 54 Mb/s}}"),
    "rules": (
        HELLO, f"{LAN}={{model: link, rules: [{{rule: bandwidth, rate: 2 Mb/s, backlog: 16 kB}}, "
        "{rule: partition, groups: [[robot_0]], from: 5 s, until: 12 s}, "
        "{rule: range, distance: 9 m}, {rule: latency, delay: 4500 us, jitter: 2500 us}]}"),
    "rules of chance": (
        HELLO, "coordination.exchange={via: broadcast, period: 300 ms}",
        f"{LAN}={{model: link, rules: [{{rule: gilbert_elliott, p: 2 %, r: 20 %}}, "
        "{rule: duplication, probability: 90 %}, {rule: reordering, probability: 20 %, "
        "delay: 400 ms}, {rule: flapping, hosts: [robot_0], up: 3 s, down: 500 ms}, "
        "{rule: jamming, at: [0 m, 0 m], radius: 5 m, probability: 5 %}]}"),
    "radios on the rung of walls": (
        HELLO, "deployment=field", f"{AIR}={{model: radio}}", "network.fidelity=walls"),
    "two media": (
        HELLO, "deployment=field",
        "network.media={lan: {model: link, rate: 1 Mb/s}, air: {model: disk, range: 8 m}}"),
    "no exchange": (HELLO, "coordination.exchange=null"),
}


@cache
def tallied(case):
    """The run of a case, which is over, and the counts that were kept beside it."""
    tally = Tally()
    simulation = built(*CASES[case], trace_sink=tally.sink, on_fate=tally.fate)
    finished(simulation)
    simulation.trace.flush()
    tally.fold(simulation.names)
    return simulation, tally


@pytest.mark.parametrize("case", CASES)
def test_every_message_meets_one_fate(case):
    simulation, tally = tallied(case)
    graph = simulation.graph
    intended = sum(topic.counts.intended for topic in graph.topics.values())
    assert len(tally.fates) == intended > 0 or case == "no exchange"
    for name, topic in graph.topics.items():
        assert tally.delivered[name] == topic.counts.delivered
        assert dict(tally.dropped.get(name, {})) == topic.counts.dropped
    for message, receiver, flight_ns in tally.flights:
        assert flight_ns >= fastest_ns(simulation, message, receiver)


@pytest.mark.parametrize("case", CASES)
def test_the_trace_says_what_the_counters_say(case):
    simulation, tally = tallied(case)
    topics = simulation.graph.topics.values()
    media = simulation.graph.media
    rows = tally.rows
    assert rows["sent"] == simulation.graph.messages
    assert rows["delivered"] == sum(topic.counts.delivered for topic in topics)
    assert rows["callback"] == sum(topic.counts.called for topic in topics)
    assert rows["repeated"] == sum(topic.counts.repeated for topic in topics)
    assert rows["repeated"] == sum(medium.copies for medium in media)
    assert rows["overwritten"] == sum(topic.counts.overwritten for topic in topics)
    assert rows["frame"] == sum(medium.frames for medium in media)
    assert tally.frame_bytes == sum(sum(medium.tx_bytes) + medium.refused_bytes
                                     for medium in media)
    assert all(medium.bytes_on_air <= sum(medium.tx_bytes) for medium in media)
    # One row for all whom a broadcast misses; a row of its own for each who got a part of it.
    in_bulk = sum(tally.missed[reason]
                  for reason in ("out_of_reach", "collision", "channel_error"))
    assert rows["dropped"] + in_bulk == sum(
        count for topic in topics for count in topic.counts.dropped.values())


def fastest_ns(simulation, message, receiver):
    """size / rate + propagation of the medium between the two, by hand."""
    choice = medium_of(simulation.scenario)
    params = choice.params
    if choice.model == "ideal":
        return params.delay_ns
    names = {simulation.graph.hosts[host].name for host in (message.source, receiver)}
    if any(names <= set(members) for members in getattr(params, "ports", {}).values()):
        return 0  # it stays inside its cluster node
    cables = {"switch": 2 * getattr(params, "propagation_ns", 0),
              "link": getattr(params, "latency_ns", 0)}.get(choice.model, 0)
    latencies = [rule.params for rule in choice.rules if rule.rule == "latency"]
    rules = sum(latency.delay_ns - latency.jitter_ns for latency in latencies)
    rate_bps = params.rate_bps
    if getattr(params, "has_mcs", False):
        rate_bps = round(1e6 * max(rate.mbps for rate in params.of_standard().rates))
    return message.size_bytes * 8 * NS_PER_S // rate_bps + cables + rules


def medium_of(scenario):
    """The medium that messages take: the first that both hosts have, and all hosts have all."""
    return next(iter(scenario.network.media.values()))


def test_the_cases_know_every_reason():
    reasons = set()
    for case in CASES:
        simulation, _ = tallied(case)
        for medium in simulation.graph.media:
            reasons.update(medium.packets_dropped)
        for topic in simulation.graph.topics.values():
            reasons.update(topic.counts.dropped)
    assert reasons == {"burst_loss", "channel_error", "collision", "host_down", "jammed",
                       "link_closed", "out_of_range", "out_of_reach", "outage", "outbox_full",
                       "partitioned", "queue_full", "random_loss", "rate_limited", "retry_limit",
                       "sender_down"}


def test_a_wrong_account_is_seen():
    simulation = built(HELLO, "stop.elapsed=3 s")
    topic = simulation.graph.topic("/robot_0/scan")
    topic.counts.intended += 1
    with pytest.raises(AssertionError, match="/robot_0/scan"):
        finished(simulation)


@st.composite
def outages(draw):
    """Of each host one after the other, at any time; the last one perhaps for good."""
    written = []
    for host in ("robot_0", "robot_1", "robot_2", "base"):
        times = sorted(draw(st.sets(st.integers(0, 8999), max_size=4)))
        for at, end in zip(times[::2], [*times[1::2], None][:len(times[::2])], strict=True):
            down = "null" if end is None else f"{end - at} ms"
            written.append(f"{{at: {at} ms, host: {host}, down_for: {down}}}")
    return draw(st.permutations(written))


@settings(max_examples=15)
@given(outages(), st.sampled_from(["unicast", "broadcast"]), st.sampled_from(["field", "testbed"]))
def test_hosts_may_stop_and_start_at_any_time(faults, via, deployment):
    finished(built(HELLO, f"faults=[{', '.join(faults)}]", f"deployment={deployment}",
                   f"coordination.exchange={{via: {via}, period: 500 ms}}",
                   "hosts={base: {at: [0 m, 0 m], monitor: true}}",
                   "network.media={air: {model: disk, range: 9 m, rate: 2 Mb/s}}",
                   "stop.elapsed=9 s"))
