"""The hosts of a simulation that run real programs: their interfaces, programs and clock."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

from desim.loop.addresses import Address
from desim.loop.capture import FrameCapture
from desim.loop.clock import ProgramClock
from desim.loop.environment import environment, hosts_file
from desim.loop.gateway import Gateway
from desim.loop.lateness import Lateness, lateness_of
from desim.loop.program_input import ProgramInput
from desim.loop.programs import ProgramEnd, ProgramStarter
from desim.loop.ros1_facade import Ros1Facade
from desim.loop.taps import opened
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.results.folder import RunFolder
from desim.scenario.robot_types import equipment_of
from desim.simulation.simulation import Simulation


class System(NamedTuple):
    """The system that the programs run on. ``clock``: virtual or wall. ``spare_ns``: see
    ``ProgramClock``. ``capture``: whether to write MEDIUM.pcap. ``home``: a folder that programs
    may write. ``name_hosts`` gets the text of their /etc/hosts."""

    clock: str
    spare_ns: int
    capture: bool
    home: Path
    name_hosts: Callable[[str], object]


@contextmanager
def attached(simulation: Simulation, folder: RunFolder, system: System) -> Iterator[None]:
    """Attach the real programs of the scenario while the clock runs; afterwards ``folder.notes``
    says how they ended and how late their frames were."""
    graph, loop = simulation.graph, simulation.scenario.loop
    hosts = [host for host in graph.hosts if host.name in loop.hosts]
    addresses = {host.index: tuple(
        Address(number, host.index) for number, medium in enumerate(graph.media)
        if medium in host.media) for host in hosts}
    names = [host.name for host in graph.hosts]
    taps = opened(addresses, names)
    system.name_hosts(hosts_file({host.name: addresses[host.index] for host in hosts}))
    clock = ProgramClock(system.spare_ns)
    late_ns: list[int] = []
    captures = ExitStack()
    gateways = [Gateway(graph, medium, [tap for tap in taps if tap.address.medium == number],
                        lambda due_ns: late_ns.append(clock.now_ns() - due_ns),
                        FrameCapture(captures.enter_context(
                            (folder.partial / f"{medium.name}.pcap").open("wb")))
                        if system.capture else None)
                for number, medium in enumerate(graph.media)]
    master = addresses[names.index(loop.ros_master)][0] if loop.ros_master else None
    inputs = ProgramInput(simulation.kernel, clock)
    for tap in taps:
        inputs.watch(tap.descriptor, partial(gateways[tap.address.medium].take, tap))
    simulation.kernel.join(inputs)
    starters: list[ProgramStarter] = []
    facades: list[Ros1Facade] = []
    for host in hosts:
        env = environment(host.name, addresses[host.index], system.home, master)
        is_robot = host.name in simulation.world.robots
        if is_robot:
            env["ROS_NAMESPACE"] = host.name
        programs = [(number, program) for number, program in enumerate(loop.programs)
                    if program.host == host.name]
        starters.append(starter := ProgramStarter(host, programs, env, folder.partial))
        _add_software(host, starter)
        if is_robot and master is not None:
            robot = simulation.world.robots.index(host.name)
            lasers = tuple(equipment_of(simulation.scenario)[robot].lasers_by_topic)
            facades.append(facade := Ros1Facade(host, lasers, env, folder.partial, inputs))
            _add_software(host, facade)
    gc.freeze()
    try:
        yield
    finally:
        captures.close()
        for facade in facades:
            facade.end()
        ends = [end for starter in starters for end in starter.end()]
        folder.notes |= {"clock": system.clock,
                         "loop": _notes(ends, lateness_of(late_ns), gateways)}


def _add_software(host: Host, node: Node) -> None:
    """Let ``host`` run ``node`` beside the nodes that it has."""
    before = host.software
    host.software = lambda host: [*before(host), node]


def _notes(ends: list[ProgramEnd], lateness: Lateness | None, gateways: list[Gateway]
           ) -> dict[str, object]:
    return {"programs": [end._asdict() for end in ends],
            "lateness": None if lateness is None else lateness._asdict(),
            "frames": sum(gateway.frames for gateway in gateways),
            "frames_to_nobody": sum(gateway.strays for gateway in gateways)}


