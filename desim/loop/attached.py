"""The hosts of a simulation that run real programs: their interfaces, programs and clock."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

from desim.loop.addresses import Address
from desim.loop.bridges import bridges_of
from desim.loop.capture import FrameCapture
from desim.loop.clock import ProgramClock
from desim.loop.environment import environment, hosts_file
from desim.loop.facade import Facade
from desim.loop.gateway import Gateway
from desim.loop.lateness import lateness_of
from desim.loop.outside_strategy import OutsideStrategies
from desim.loop.program_input import ProgramInput
from desim.loop.programs import OnEnd, ProgramStarter
from desim.loop.taps import HostTap, opened
from desim.middleware.host import Host
from desim.network.medium import Medium
from desim.results.folder import RunFolder
from desim.scenario.robot_types import equipment_of
from desim.simulation.simulation import Simulation


class System(NamedTuple):
    """The system that the programs run on. ``clock``: virtual or wall. ``begin_every_ns`` and
    ``spare_ns``: see ``ProgramClock``. ``capture``: whether to write MEDIUM.pcap. ``home``: a
    folder that programs may write. ``name_hosts`` gets the text of their /etc/hosts, ``on_end``
    each program that ends by itself."""

    clock: str
    begin_every_ns: int
    spare_ns: int
    capture: bool
    home: Path
    name_hosts: Callable[[str], object]
    on_end: OnEnd


@contextmanager
def attached(simulation: Simulation, folder: RunFolder, system: System,
             strategies: OutsideStrategies) -> Iterator[None]:
    """Attach the real programs of the scenario while the clock runs; afterwards ``folder.notes``
    says how they ended and how late their frames were. ``strategies``: those of the robots that
    programs send goals."""
    with ExitStack() as files:
        programs = _RealPrograms(simulation, folder, system, strategies, files)
        gc.freeze()
        programs.clock.begin(system.begin_every_ns)
        try:
            yield
        finally:
            folder.notes |= {"clock": system.clock, "loop": programs.end()}
            if system.clock == "wall":  # which no run repeats
                folder.notes["digest"] = None


class _RealPrograms:
    """All hosts with real programs: ``addresses`` of each by its index. ``files`` get the captures.
    """

    def __init__(self, simulation: Simulation, folder: RunFolder, system: System,
                 strategies: OutsideStrategies, files: ExitStack) -> None:
        self._simulation, self._folder, self._system, self._files = (simulation, folder, system,
                                                                     files)
        self._strategies = strategies
        graph, loop = simulation.graph, simulation.scenario.loop
        hosts = [host for host in graph.hosts if host.name in loop.hosts]
        self._addresses = {host.index: tuple(
            Address(number, host.index) for number, medium in enumerate(graph.media)
            if medium in host.media) for host in hosts}
        taps = opened(self._addresses, [host.name for host in graph.hosts])
        system.name_hosts(hosts_file({host.name: self._addresses[host.index] for host in hosts}))
        self.clock = ProgramClock(system.spare_ns)
        self._late_ns: list[int] = []
        self._gateways = [self._gateway(number, medium, taps)
                          for number, medium in enumerate(graph.media)]
        self._inputs = ProgramInput(simulation.kernel, self.clock)
        for tap in taps:
            self._inputs.watch(tap.descriptor,
                               partial(self._gateways[tap.address.medium].take, tap))
        simulation.kernel.join(self._inputs)
        self._starters: list[ProgramStarter] = []
        self._facades: list[Facade] = []
        for host in hosts:
            self._equip(host)

    def end(self) -> dict[str, object]:
        """End all programs. Returns what the manifest says of them."""
        failed = [end for facade in self._facades for end in facade.end()]
        lateness = lateness_of(self._late_ns)
        return {"programs": [end._asdict() for end in (
            *(end for starter in self._starters for end in starter.end()), *failed)],
                "lateness": None if lateness is None else lateness._asdict(),
                "valid": lateness is None or lateness.valid,
                "refused_goals": {facade.host.name: facade.refused_goals for facade in self._facades
                                  if facade.refused_goals},
                "frames": sum(gateway.frames for gateway in self._gateways),
                "frames_to_nobody": sum(gateway.strays for gateway in self._gateways)}

    def _gateway(self, number: int, medium: Medium, taps: list[HostTap]) -> Gateway:
        capture = None
        if self._system.capture:
            file = (self._folder.partial / f"{medium.name}.pcap").open("wb")
            capture = FrameCapture(self._files.enter_context(file))
        return Gateway(self._simulation.graph, medium,
                       [tap for tap in taps if tap.address.medium == number], self._late, capture)

    def _late(self, due_ns: int) -> None:
        self._late_ns.append(self.clock.now_ns() - due_ns)

    def _equip(self, host: Host) -> None:
        """Let ``host`` start its programs. A robot's host has the facades of the robot as well."""
        simulation, system, logs = self._simulation, self._system, self._folder.partial
        loop, robots = simulation.scenario.loop, simulation.world.robots
        master = None if loop.ros_master is None else self._addresses[
            simulation.graph.host(loop.ros_master).index][0]
        env = environment(host.name, self._addresses[host.index], system.home, master,
                          loop.dds_domain)
        if host.name in robots:
            env["ROS_NAMESPACE"] = host.name
        starter = ProgramStarter(host, [(number, program)
                                        for number, program in enumerate(loop.programs)
                                        if program.host == host.name], env, logs,
                                 self._inputs, system.on_end)
        self._starters.append(starter)
        desim_s = host.software
        host.software = lambda host: [
            *desim_s(host), starter,
            *(self._new_facades(host, env) if host.name in robots else ())]
        for bridge in bridges_of(simulation.scenario):
            (logs / bridge.log(host.name)).unlink(missing_ok=True)  # of a run that was killed

    def _new_facades(self, robot: Host, env: Mapping[str, str]) -> list[Facade]:
        """The facades of a robot that starts."""
        simulation = self._simulation
        lasers = tuple(equipment_of(simulation.scenario)[
            simulation.world.robots.index(robot.name)].lasers_by_topic)
        new = [Facade(robot, bridge, lasers, env, self._folder.partial, self._inputs, self.clock,
                      self._strategies.of.get(robot.name))
               for bridge in bridges_of(simulation.scenario)]
        self._facades += new
        return new
