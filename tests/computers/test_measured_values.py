"""Are the measured costs those of docs/computers.md, and do they hold beside other numbers?"""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

from desim.computers.computer import Computer
from desim.computers.costs import measured_values
from desim.computers.costs.measured import MeasuredCosts
from desim.computers.processors import Processors
from desim.computers.scheduling import ProcessorSharing
from desim.engine.kernel import Kernel
from desim.ports.computers import Kept, Work

PAGE = Path(__file__).resolve().parents[2] / "docs" / "computers.md"
CELLS = 401 * 401  # that nodes declare in the paper's terrains
COSTS = MeasuredCosts(MeasuredCosts.Params())


def ms(node: str, trigger: str, **quantities: int) -> float:
    return COSTS.callback_ns(Work(node, trigger, quantities)) / 1e6


class Twice(MeasuredCosts):
    def callback_ns(self, work: Work) -> int:
        return 2 * super().callback_ns(work)


def test_a_model_that_inherits_has_its_own_callbacks() -> None:
    processors = Processors(Kernel(), 0, 1, Fraction(1), ProcessorSharing())
    once, twice = (Computer(processors, model, {}).costs.of_callback("slam", "odom")({"beams": 9})
                   for model in (COSTS, Twice(Twice.Params())))
    assert twice == 2 * once > 0


def matched_scan_ms(beams: int, costs: Callable[..., float] = ms) -> float:
    return costs("slam", "odom", scans=1, particles=30, beams=30 * beams)


def is_near_the_whole_program(costs: Callable[..., float]) -> bool:
    """openslam_gmapping on MIT CSAIL: 295 ms of processor a matched scan of 361 beams, 30
    particles, measured as a whole and on another machine (a third apart at most)."""
    return abs(matched_scan_ms(361, costs) / 295 - 1) < 1 / 3


def test_gmapping_s_parts_are_near_the_whole_program() -> None:
    assert is_near_the_whole_program(ms)
    assert not is_near_the_whole_program(lambda *work, **quantities: ms(*work, **quantities) / 2)


def test_callbacks_of_the_paper_s_robot_take_milliseconds() -> None:
    assert [round(time, 2) for time in (
        matched_scan_ms(180), ms("slam", "odom"), ms("slam", "redraw", scans=200, cells=CELLS),
        ms("move_base", "control", candidates=60), ms("move_base", "goal", plans=1, cells=CELLS),
        ms("explore", "costmap", plans=1, cells=CELLS, candidates=11), ms("explore", "watch"),
    )] == [113.75, 0.05, 74.06, 1.21, 4.68, 64.02, 0.81]


def test_a_poll_of_the_master_costs_more_with_each_teammate() -> None:
    """The answer has 20 topics of each robot; 21, 161, 601 topics took 235, 710, 1770 us."""
    assert [round(ms("map_sharing", "loop", candidates=teammates), 2)
            for teammates in (0, 7, 29)] == [0.22, 0.6, 1.79]


def test_a_large_map_costs_its_sender_each_link_and_its_receiver_milliseconds() -> None:
    alone, nine = (COSTS.send_ns("map", 640_113, links) / 1e6 for links in (1, 9))
    assert (round(alone, 2), round(nine, 2)) == (0.8, 5.51)
    assert round(COSTS.receive_ns("map", 640_113) / 1e6, 2) == 0.81
    assert round(COSTS.send_ns("scan", 845, 3) / 1e3) == 126


@pytest.mark.parametrize(("row", "constant_ps"), [
    ("laserCallback, a scan that is not matched", measured_values.GMAPPING_SCAN),
    ("a scan that is matched, each particle and beam", measured_values.GMAPPING_BEAM),
    ("the same, each particle", measured_values.GMAPPING_PARTICLE),
    ("updateMap, each scan of the trajectory", measured_values.GMAPPING_REDRAWN_SCAN),
    ("updateMap, each cell of the map", measured_values.GMAPPING_MAP_CELL),
    ("control at 10 Hz, fixed", measured_values.LOCAL_PLAN),
    ("navfn, a plan, each cell of the map", measured_values.NAVFN_CELL),
    ("each second, a cell of its map", measured_values.EXPLORE_CELL),
    ("getPublishedTopics at 10 Hz, for the caller", measured_values.POLL_CALL),
    ("merge of a map, each cell", measured_values.MERGED_CELL),
    ("publish, a message", measured_values.SEND.message_ps),
    ("publish, a link", measured_values.SEND.link_ps),
    ("receive", measured_values.RECEIVE.message_ps),
])
def test_the_page_has_the_constant(row: str, constant_ps: int) -> None:
    found = re.search(rf"^\| {re.escape(row)} \| ([\d.]+) (ns|us|ms)\b", PAGE.read_text(), re.M)
    assert found is not None
    assert float(found[1]) * {"ns": 1e3, "us": 1e6, "ms": 1e9}[found[2]] == constant_ps


def mb(node: str, **quantities: int) -> float:
    return COSTS.process_bytes(Kept(node, quantities)) / 1e6


@pytest.mark.parametrize(("scans", "patches", "least_mb", "most_mb"), [
    (110, 70, 38, 43), (420, 97, 60, 66)])
def test_gmapping_s_memory_is_that_of_the_piece(scans: int, patches: int, least_mb: float,
                                                most_mb: float) -> None:
    """Without its process; twin: the patches of one particle alone."""
    process_mb = mb("slam")
    assert least_mb < mb("slam", scans=scans, patches=30 * patches) - process_mb < most_mb
    assert mb("slam", scans=scans, patches=patches) - process_mb < least_mb


def test_processes_of_the_paper_s_robot_take_megabytes() -> None:
    assert [round(size_mb, 1) for size_mb in (
        COSTS.system_bytes() / 1e6, mb("pose_publisher"), mb("move_base", cells=CELLS),
        mb("explore", cells=CELLS), mb("map_sharing", cells=9 * CELLS))] == [
            48.2, 1.2, 14.7, 14.7, 12.8]
    assert mb("driver") == 0
