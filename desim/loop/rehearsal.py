"""A rehearsal compiles what a run with real programs needs: their clock does not wait for it."""

from __future__ import annotations

from desim.engine.kernel import Phase
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S

_SIZES_BYTES = (64, 1518)


def rehearse(scenario: Scenario) -> None:
    """Send frames between the hosts of the real programs of ``scenario``, over each medium, for two
    simulated seconds. Nothing of it is kept."""
    simulation = Simulation(scenario)
    graph, kernel = simulation.graph, simulation.kernel
    hosts = [host for host in graph.hosts if host.name in scenario.loop.hosts]
    for number, medium in enumerate(graph.media):
        on_it = [host.index for host in hosts if medium in host.media]
        if len(on_it) > 1:
            kernel.at((number + 1) * NS_PER_S // 1000, Phase.NETWORK, medium.id, _send_some,
                      (medium, on_it))
    simulation.run(2 * NS_PER_S)


def _send_some(what: tuple[Medium, list[int]]) -> None:
    medium, (first, *others) = what
    carrier: Carrier[None] = Carrier()
    for size_bytes in _SIZES_BYTES:
        medium.transmit(first, tuple(others), size_bytes, 1, True, carrier, None)
        medium.transmit(others[0], (first,), size_bytes, 1, False, carrier, None)
