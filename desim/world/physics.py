"""The world that ``physics.model`` names: a world, or bodies of another simulator on the plane."""

from __future__ import annotations

from desim import plugins
from desim.engine.streams import Streams
from desim.ports import World
from desim.scenario.schema.scenario import Scenario


def world_of(scenario: Scenario, streams: Streams) -> World:
    """The world at time 0 of a scenario whose paths are absolute. Raises ``InputError``."""
    model = plugins.load("world", scenario.physics.model)
    if hasattr(model, "build"):
        built: World = model.build(scenario, streams)
        return built
    from desim.world.plane import Plane  # its kernels take time to load, and a world may be another

    return Plane.build(scenario, streams, model())
