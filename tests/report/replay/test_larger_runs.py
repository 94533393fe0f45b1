"""The fleet of the paper, and a fleet that a broken network splits, in a browser."""

import numpy as np
import pyarrow.compute as pc
import pytest
from devtools import Browser

import desim
from desim.api import recording_of
from desim.monitor.traffic import kind
from desim.report.replay.page import write
from desim.results.beliefs import beliefs_at
from desim.units import NS_PER_S

pytestmark = pytest.mark.usefixtures("browser_here")


@pytest.fixture(scope="module")
def partitioned(tmp_path_factory, repository):
    """Sixteen robots with a ROS master each; the network is split from 4 s to 9 s."""
    scenario = desim.load(repository / "scenarios" / "multimaster_disconnect.yaml", [
        "network.media.air.rules=[{rule: partition, from: 4 s, until: 9 s, "
        "groups: [[robot_8, robot_9, 'robot_1?']]}]", "stop.elapsed=12 s",
        "trace.keep=all"])
    return desim.run(scenario, out=tmp_path_factory.mktemp("partitioned"))


def test_maze_30(tmp_path, repository):
    run = desim.run(desim.load(repository / "scenarios" / "maze_30.yaml", ["stop.elapsed=12 s"]),
                    out=tmp_path)
    recording, page = recording_of(run), tmp_path / "replay.html"
    write([recording], page)
    with Browser(tmp_path / "profile") as browser:
        browser.open(page)
        for k in (0, 77, len(recording.poses.times_ns) - 1):
            at_s = int(recording.poses.times_ns[k]) / NS_PER_S
            browser.value(f"desimReplay.at({at_s!r})")
            found = np.array(browser.value("desimReplay.positions()"))
            assert (found[:, :2] == recording.poses.xy_mm[k] / 1000).all()
        browser.value("desimReplay.select({kind: 'family', family: 0}); desimReplay.at(10)")
        assert browser.value("document.querySelector('#selection h2').textContent") == "/*/cmd_vel"
        assert browser.complaints == []


def test_a_partitioned_fleet(tmp_path, partitioned):
    page = tmp_path / "replay.html"
    write([recording_of(partitioned)], page)
    with Browser(tmp_path / "profile") as browser:
        browser.open(page)
        browser.value("desimReplay.at(3)")
        caption = "document.querySelector('.caption').textContent"
        assert "parts" not in browser.value(caption)
        for at_s in (3, 5, 8, 11):
            browser.value(f"desimReplay.at({at_s})")
            assert ("2 parts" in browser.value(caption)) == (4 < at_s < 9)
            assert_beliefs(browser, partitioned, at_s)
        browser.value("desimReplay.at(8)")
        assert not browser.value("document.querySelector('#beliefs').hidden")
        begin = browser.value("""(() => { desimReplay.at(0);
            return desimReplay.app.panel.events.events.filter(
                (event) => event.kind === "partition").map((event) => event.timeS); })()""")
        assert begin == [4.0, 9.0]
        # The list of events goes back with the time, too.
        scrolled = browser.value("""[11, 0].map((at) => {
            const list = document.querySelector("#events ol");
            list.style.maxHeight = "10px";
            desimReplay.at(at);
            return list.scrollTop; })""")
        assert scrolled[0] > 0 and scrolled[1] == 0
        assert browser.complaints == []


def assert_beliefs(browser, run, at_s):
    """The page folds the beliefs as ``desim graph`` does."""
    seen = browser.value("[...desimReplay.app.scenes[0].beliefs.sees.values]")
    hosts = browser.value("desimReplay.app.runs[0].hosts")
    words = ["never", "online", "offline", "removed"]
    found = {(hosts[k // len(hosts)], hosts[k % len(hosts)]): words[state]
             for k, state in enumerate(seen) if k // len(hosts) != k % len(hosts)}
    assert found == {(view.believer, view.other): view.sees
                     for view in beliefs_at(run, at_s * NS_PER_S).views}


def test_waiting_messages_are_counted_at_the_instant(tmp_path, repository):
    """At any speed: those that were born and of which no frame has left."""
    run = desim.run(desim.load(repository / "scenarios" / "field_30.yaml", [
        "stop.elapsed=8 s", "coordination.exchange.period=1 s",
        "network.media.air={preset: null, path_loss: {exponent: 3}}"]), out=tmp_path)
    page = tmp_path / "replay.html"
    write([recording_of(run)], page)
    messages = recording_of(run).messages
    born, end = (messages[name].to_numpy() for name in ("born_ns", "end_ns"))
    left = pc.coalesce(messages["first_ns"], messages["end_ns"]).to_numpy()
    shown = np.array([kind(topic) != "simulation" for topic in messages["topic"].to_pylist()])
    hosts = np.array(messages["source"].to_pylist())
    # The page has microseconds: instants that are none.
    at_ns = np.arange(2_000_000_500, 8 * NS_PER_S, 997_000_000)
    counts = []
    with Browser(tmp_path / "profile") as browser:
        browser.open(page)
        for now in at_ns.tolist():
            waits = shown & (born <= now) & (np.minimum(left, end) > now)
            names, sizes = np.unique(hosts[waits], return_counts=True)
            counts.append(dict(zip(names.tolist(), sizes.tolist(), strict=True)))
            for speed in (1, 50):
                found = browser.value(f"""(() => {{
                    const {{ app }} = desimReplay, {{ run, flights }} = app.scenes[0];
                    app.player.speed = {speed};
                    desimReplay.at({now / NS_PER_S!r});
                    return Object.fromEntries([...flights.waiting].map(
                        ([host, count]) => [run.hosts[host], count])); }})()""")
                assert found == counts[-1], (now, speed)
    assert max(sum(each.values()) for each in counts) > 1
