"""The contracts: what a plug-in sees of desim, and what desim asks of a plug-in.

A network plug-in needs this package, ``desim.units`` and ``desim.errors``, and nothing else of
desim. Values here stay small: what a model wants to remember about a frame it keeps in a table of
its own, keyed by the frame's id.
"""

from desim.ports.bodies import Arena, Bodies
from desim.ports.capabilities import (
    ChecksHosts,
    CountsAirtime,
    CountsAttempts,
    CountsBusyTime,
    CountsControl,
    CutsCarrier,
    FollowsHosts,
    Handover,
    HearsAntennas,
    Itemizes,
    JudgesTransmissions,
    KnowsDepartures,
    KnowsHandovers,
    KnowsLinks,
    LimitsReach,
    NamesAccessPoints,
    NamesChannels,
    PassesMany,
    PlacedAccessPoint,
    PredictsSignal,
    Queues,
    Refuses,
    Retransmits,
    SendsMany,
    Separates,
    Signal,
    SwitchesAccessPoints,
    TakesBack,
)
from desim.ports.federates import Federate
from desim.ports.frames import (
    FULL_PACKET_BYTES,
    PASS,
    Deliver,
    Drop,
    Duplicate,
    Frame,
    Frames,
    Pass,
    Verdict,
    packet_sizes,
)
from desim.ports.function_rules import RuleFunction, function_rule, rule_of
from desim.ports.model_choices import Builds, model_of
from desim.ports.networks import (
    Antennas,
    Context,
    Handle,
    NetworkModel,
    Obstacles,
    Rule,
    RuleContext,
)
from desim.ports.parameters import (
    BesideScenario,
    Constants,
    File,
    Named,
    Params,
    Preset,
    natural_key,
    tuples,
    with_preset,
    yaml_key,
)
from desim.ports.scope import Targets, TimeWindow, Topics, scope_beside, with_scope
from desim.ports.strategies import (
    FollowsGoals,
    FollowsMap,
    FollowsTask,
    FollowsTeam,
    Frontier,
    GoalEnd,
    Mark,
    Peer,
    Place,
    Pose2D,
    Ranges,
    RecordedPaths,
    Starts,
    Strategy,
    StrategyContext,
    StrategyMessage,
    StrategyTraits,
    TeamArea,
    TeamLink,
)
from desim.ports.time_parts import Ledger, TimePart
from desim.ports.unused_keys import KnowsUnusedKeys, ReadsMarks, UnusedKeys, changed_keys
from desim.ports.worlds import GridSpec, HasDoubts, MovesObstacles, RandomStreams, Snapshot, World

__all__ = [
    "Antennas", "Arena", "BesideScenario", "Bodies", "Builds", "ChecksHosts", "Constants",
    "Context", "CountsAirtime", "CountsAttempts", "CountsBusyTime", "CountsControl", "CutsCarrier",
    "Deliver", "Drop", "Duplicate", "FULL_PACKET_BYTES", "Federate", "File", "FollowsGoals",
    "FollowsHosts", "FollowsMap", "FollowsTask", "FollowsTeam", "Frame", "Frames", "Frontier",
    "GoalEnd", "GridSpec", "Handle", "Handover", "HasDoubts", "HearsAntennas", "Itemizes",
    "JudgesTransmissions", "KnowsDepartures", "KnowsHandovers", "KnowsLinks", "KnowsUnusedKeys",
    "Ledger", "LimitsReach", "Mark", "MovesObstacles", "Named", "NamesAccessPoints",
    "NamesChannels", "NetworkModel", "Obstacles", "PASS", "Params", "Pass", "PassesMany", "Peer",
    "Place", "PlacedAccessPoint", "Pose2D", "PredictsSignal", "Preset", "Queues", "RandomStreams",
    "Ranges", "ReadsMarks", "RecordedPaths", "Refuses", "Retransmits", "Rule", "RuleContext",
    "RuleFunction", "SendsMany", "Separates", "Signal", "Snapshot", "Starts", "Strategy",
    "StrategyContext", "StrategyMessage", "StrategyTraits", "SwitchesAccessPoints", "TakesBack",
    "Targets", "TeamArea", "TeamLink", "TimePart", "TimeWindow", "Topics", "UnusedKeys", "Verdict",
    "World", "changed_keys", "function_rule", "model_of", "natural_key", "packet_sizes", "rule_of",
    "scope_beside", "tuples", "with_preset", "with_scope", "yaml_key",
]
