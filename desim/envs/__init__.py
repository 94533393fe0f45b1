"""Reinforcement learning: a scenario as a parallel environment of PettingZoo."""

from desim.errors import extra

with extra("envs", "desim.envs"):
    from desim.envs.fleet import FleetEnv
    from desim.envs.frontier_choices import FrontierChoices
    from desim.envs.velocities import Velocities

parallel_env = FleetEnv  # as PettingZoo's own environments are called

__all__ = ["FleetEnv", "FrontierChoices", "Velocities", "parallel_env"]
