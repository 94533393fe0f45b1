"""Associations with access points: in the trace, in the summary, and in the replay."""

import numpy as np
import pytest
from devtools import Browser
from test_bundle import columns_of

import desim
from desim.api import recording_of
from desim.report.replay.page import write
from desim.units import NS_PER_S
from netmodels.infrastructure.associations import Associations

KINDS = "associated", "disassociated"


def roamed(repository, out, *changes):
    """Six robots in a warehouse, on none of its six access points at first; one stops and starts
    again."""
    return desim.run(repository / "scenarios/warehouse_wifi.yaml", out=out, overrides=[
        "network.media.air.infrastructure.associated=false", "stop.elapsed=26 s",
        "faults=[{at: 4 s, host: robot_0, down_for: 2 s}]", *changes])


@pytest.fixture(scope="module")
def run(tmp_path_factory, repository):
    return roamed(repository, tmp_path_factory.mktemp("roamed"))


def rows_of(run):
    """(ns, kind, host, access point or "0", medium) of each row."""
    return [(event.time_ns, event.kind, event.entity, *event.detail.split()[:2])
            for event in recording_of(run).events if event.kind in KINDS]


def handovers_of(rows):
    """The handovers, from the rows alone."""
    found, left = [], {}
    for ns, kind, host, access_point, medium in rows:
        if kind == "disassociated":
            left[host] = ns, None if access_point == "0" else access_point
        elif ns > 0:
            since_ns, before = left.pop(host)
            found.append({"time_s": ns / NS_PER_S, "medium": medium.removeprefix("medium/"),
                          "host": host, "from": before, "to": access_point,
                          "gap_s": (ns - since_ns) / NS_PER_S})
    return found


def test_the_rows_are_the_handovers(run):
    handovers = run.metrics["handovers"]
    assert handovers_of(rows_of(run)) == handovers
    own = [(one["from"], one["to"]) for one in handovers if one["host"] == "robot_0"]
    assert own == [(None, "ap_0"), ("ap_0", "ap_0")]  # before and after its host stopped
    assert any(one["from"] not in (None, one["to"]) for one in handovers)
    assert run.metrics["handover_gap_s"]["count"] == len(handovers) == len(
        [row for row in rows_of(run) if row[1] == "associated"])


def test_the_twin_that_keeps_its_leaving_to_itself_is_found_out(monkeypatch, repository, tmp_path):
    notify = Associations._notify
    monkeypatch.setattr(Associations, "_notify", lambda self, host, access_point: access_point and
                        notify(self, host, access_point))
    silent = roamed(repository, tmp_path, "stop.elapsed=8 s")
    with pytest.raises(KeyError, match="robot_0"):
        handovers_of(rows_of(silent))


def test_each_station_has_a_row_at_the_start(run, repository, tmp_path):
    """On none here, on the strongest by default; the base is at the wires."""
    names = [f"robot_{k}" for k in range(6)]

    def first(rows):
        return [row[1:4] for row in rows if row[0] == 0]

    assert first(rows_of(run)) == [("disassociated", name, "0") for name in names]
    begun = desim.run(repository / "scenarios/warehouse_wifi.yaml", out=tmp_path,
                      overrides=["stop.elapsed=1 s"])
    assert [row[:2] for row in first(rows_of(begun))] == [("associated", name) for name in names]
    assert begun.metrics["handovers"] == handovers_of(rows_of(begun)) == []


def test_a_host_that_is_not_attached_has_neither(repository, tmp_path):
    found = roamed(repository, tmp_path, "stop.elapsed=6 s", "network.media.lan={model: switch}",
                   "network.media.air.hosts=[base, robot_0, robot_3]")
    assert {row[2] for row in rows_of(found)} == {"robot_0", "robot_3"}
    assert {one["host"] for one in found.metrics["handovers"]} == {"robot_0", "robot_3"}


def test_other_networks_have_no_such_rows(hello):
    assert not {*KINDS} & {*hello.names.values()}
    assert not {"access_points", "handovers"} & hello.metrics.keys()
    about, found = columns_of(hello)
    assert about["access_points"] == about["stations"] == [] and not found["association.ns"].size


def hanging(run, time_ns):
    """The number of each robot's access point, None for none, at an instant, from the rows."""
    names = [one["name"] for one in run.metrics["access_points"]]
    now = dict.fromkeys(recording_of(run).robots)
    for ns, kind, host, access_point, _ in rows_of(run):
        if ns <= time_ns:
            now[host] = names.index(access_point) if kind == "associated" else None
    return list(now.values())


def test_the_bundle_has_who_hangs_on_whom(run):
    about, found = columns_of(run)
    scenario = run.scenario.network.media["air"].params
    assert [(one["medium"], one["name"], one["x_m"], one["y_m"], one["channel"])
            for one in about["access_points"]] == [
        ("air", f"ap_{k}", *one.at_m, one.channel) for k, one in enumerate(scenario.access_points)]
    assert [about["hosts"][host] for host in about["stations"]] == about["robots"]
    columns = [found[f"association.{name}"][0] for name in ("ns", "host", "access_point", "hangs")]
    assert [(ns, KINDS[1 - hangs], about["hosts"][host], f"ap_{point}", "medium/air")
            for ns, host, point, hangs in np.array(columns).T.tolist()] == [
        row for row in rows_of(run) if row[3] != "0"]


@pytest.fixture(scope="module")
def page(browser_here, tmp_path_factory, run):
    """Its replay in a browser."""
    file = tmp_path_factory.mktemp("page") / "replay.html"
    write([recording_of(run)], file)
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        browser.open(file)
        yield browser
        assert browser.complaints == []


def test_the_page_knows_it_at_any_time(page, run):
    changes = [row[0] for row in rows_of(run) if row[0]]
    times_ns = [0, *(ns + 1000 for ns in changes), *(ns - 1000 for ns in reversed(changes))]
    found = page.value(f"""{[ns / NS_PER_S for ns in times_ns]}.map((timeS) => {{
        const {{ associations, run }} = desimReplay.app.scenes[0];
        return run.hostOfRobot.map((host) => associations.of(host, timeS)); }})""")
    assert found == [[[] if one is None else [one] for one in hanging(run, ns)]
                     for ns in times_ns]
    assert found[0] == [[]] * 6 and [] not in found[len(changes)]


DRAWN = """(() => {
    const { app } = desimReplay, [scene] = app.scenes, found = { marks: [], lines: [], none: 0 };
    const context = new Proxy({}, { get: (own, name) => own[name] ?? (() => {}),
        set: (own, name, value) => { own[name] = value; return true; } });
    const { theme, layers, stage: { camera } } = app;
    const view = scene.view(camera,
        { timeS: app.player.timeS, theme, ratio: 1, speed: 1, layers, selection: {} });
    context.setLineDash = (dash) => { if (dash.length) found.lines.push(context.strokeStyle); };
    scene.associations.draw(context, camera, view);
    const { labels } = view;
    view.labels = { of: (text, style) => {
        found.marks.push(text);
        return labels.of(text, style); } };
    Object.defineProperty(context, "strokeStyle", { set: (value) => {
        if (value === theme.alarm) found.none += 1; } });
    const [, points] = scene.sheets.flat().filter(([layer]) => layer === "wifi");
    points[1].draw(context, camera, view);
    return found; })()"""


def test_access_points_lines_and_marks_are_drawn(page, run):
    """A line for each robot that hangs on one, in its colour; a mark for each other that runs."""
    hues = page.value("desimReplay.app.theme.hues")
    labels = [f"ap_{k} · ch {channel}" for k, channel in enumerate([1, 6, 11, 11, 1, 6])]
    for time_s, down in (0.1, 0), (3.0, 0), (5.0, 1), (25.0, 0):
        page.value(f"desimReplay.at({time_s})")
        drawn, now = page.value(DRAWN), hanging(run, int(time_s * NS_PER_S))
        assert drawn["marks"] == labels
        assert drawn["lines"] == [hues[k] for k, one in enumerate(now) if one is not None]
        assert drawn["none"] == now.count(None) - down


def test_the_layer_can_be_switched_off(page, hello, tmp_path):
    picture = ("desimReplay.draw(), [...document.querySelector('.pane').querySelectorAll('canvas')]"
               ".map((sheet) => sheet.toDataURL()).join()")
    page.value("desimReplay.at(20), desimReplay.select({})")
    with_them = page.value(picture)
    box = "document.querySelector('#layers input[name=wifi]')"
    page.value(f"{box}.click()")
    assert page.value(picture) != with_them
    page.value(f"{box}.click()")
    assert page.value(picture) == with_them
    write([recording_of(hello)], tmp_path / "replay.html")
    with Browser(tmp_path / "profile") as other:
        other.open(tmp_path / "replay.html")
        assert other.value(f"{box} === null")
