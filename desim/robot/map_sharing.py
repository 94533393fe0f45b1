"""The node through which robots exchange the evidence that each has gathered itself."""

from __future__ import annotations

from fractions import Fraction

from desim.errors import below
from desim.middleware.contents import Empty, Pose
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.middleware.topics import Latest, WaitSet
from desim.robot.map_message import MapFormat, MapUpdate
from desim.robot.robot_map import RobotMap
from desim.robot.team import Team
from desim.robot.tiles import LayerSnapshot
from desim.scenario.schema.communication import Exchange
from desim.units import NS_PER_S

# Periods after which a robot sends all its evidence even if nothing has changed, for peers that
# missed a part or started again. Otherwise it sends nothing without a change (gmapping publishes
# only after a processed scan).
# (20 % less or more changes no run of scenarios/maze_8.yaml, where no message is lost.)
REFRESH_PERIODS = 6
# multirobot_map_merge's merging_rate (map_merging's is 10 Hz). A fleet of 200 that exchanges maps
# every 5 s then merges ten updates at once instead of one by one.
MERGING_HZ = 4


class MapSharing(Node):
    """Sends this robot's own evidence to the others every ``exchange.period_ns`` if it changed, and
    merges theirs into ``robot_map`` ``MERGING_HZ`` times a second: the last update of each that has
    come. ``exchange`` None: this robot shares nothing.

    With ``changed_tiles`` an update holds the tiles that changed since the last one sent. A robot
    that missed one has the newest of each tile that it did get, and the rest at the next complete
    update. The map topic is latched, as gmapping's is.

    The event ``map`` announces to other nodes of the host that an update changed the map, the
    event ``peers`` that ``team`` has one peer more: the pose of each at its last update.
    """

    def __init__(self, host: Host, exchange: Exchange | None, robot_map: RobotMap,
                 peers: tuple[str, ...], team: Team) -> None:
        super().__init__(host, "map_sharing")
        self.robot_map = robot_map
        self._exchange = exchange
        self._peers = peers
        self._topic = f"/map_exchange/{host.name}"
        self._pose = Latest(host)
        self._updates = WaitSet()
        self._sent: LayerSnapshot | None = None  # all of the evidence at the last update
        self._complete_at = 0  # the period in which everything was sent last
        self._team = team
        if exchange is not None:
            self._codec = MapFormat.of(robot_map.spec, exchange)

    def start(self) -> None:
        if self._exchange is None:
            return
        self.advertise("map")
        self.advertise("peers")
        with below("coordination.exchange"):
            self.advertise(self._topic, transport="stream", latch=True, via=self._exchange.via)
        self._pose = self.latest("pose")
        for peer in self._peers:
            self.latest(f"/map_exchange/{peer}", self._updates)
        self.timer(Fraction(NS_PER_S, self._exchange.period_ns), self._on_period)
        self.timer(MERGING_HZ, self._merge)

    def _on_period(self, period: int) -> None:
        if self._pose.message is None or not self.has_subscribers(self._topic):
            return
        layer = self._unsent(period)
        if layer is not None:
            pose: Pose = self._pose.message.content
            self.publish(self._topic, MapUpdate(self.host.name, self.now_ns, pose.x_m, pose.y_m,
                                                pose.yaw_rad, layer, self._codec.size_bytes(layer)))

    def _unsent(self, period: int) -> LayerSnapshot | None:
        """The evidence to send now, noted as sent; None if there is none."""
        known, sent = self.robot_map.own.snapshot(), self._sent
        if sent is None:
            if not len(known.filled()):
                return None
        elif period - self._complete_at < REFRESH_PERIODS:
            changed = self.robot_map.own.changed_since(sent)
            if not len(changed):
                return None
            if self._codec.content == "changed_tiles":
                self._sent = known
                return known.only(changed)
        self._sent, self._complete_at = known, period
        return known

    def _merge(self, _: int) -> None:
        """Take in what has come since the last time, all at once."""
        updates: list[MapUpdate] = [message.content for _, message in self._updates.news()]
        if not updates:
            return
        team, now_ns = self._team, self.now_ns
        before = len(team.peers)
        for update in updates:
            team.note_pose(update.source, update.x_m, update.y_m, update.yaw_rad, update.version,
                           now_ns)
        if len(team.peers) > before:
            self.publish("peers", Empty())
        if self.robot_map.receive((update.source, update.version, update.layer)
                                  for update in updates):
            self.publish("map", Empty())
