"""Checks that plug-in authors run: one function says whether a class keeps its contract.

``check_network(MyModel, rate="1 Mb/s")`` builds the plug-in from keywords as a scenario would,
plays it a small seeded load and raises ``AssertionError`` with what to change (``ModelError`` for a
verdict that is none, ``InputError`` for wrong parameters). ``Bench`` is the place where that load
runs, ``Fleet`` the hosts that a middleware is tried on, and where a plug-in's own tests can run
theirs.
"""

from desim.testing.checks import check_case, check_network, check_rule
from desim.testing.computers_checks import check_computers
from desim.testing.fleet import Fleet
from desim.testing.local_planner_bench import LocalPlannerBench
from desim.testing.local_planner_checks import check_local_planner
from desim.testing.localization_bench import LocalizationBench
from desim.testing.localization_checks import check_localization
from desim.testing.medium_bench import HOUR_NS, Bench, ImmediateNetwork
from desim.testing.middleware import Patience, check_discovery, check_middleware
from desim.testing.sharing_bench import SharingBench
from desim.testing.sharing_checks import check_sharing
from desim.testing.strategy_bench import StrategyBench
from desim.testing.strategy_checks import check_strategy
from desim.testing.task_bench import TaskBench
from desim.testing.task_checks import check_task

__all__ = ["Bench", "Fleet", "HOUR_NS", "ImmediateNetwork", "LocalPlannerBench",
           "LocalizationBench", "Patience", "SharingBench", "StrategyBench", "TaskBench",
           "check_case", "check_computers", "check_discovery", "check_local_planner",
           "check_localization", "check_middleware", "check_network", "check_rule",
           "check_sharing", "check_strategy", "check_task"]
