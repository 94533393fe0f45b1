"""Each robot sends the evidence that it has gathered itself."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim.ports.sharing import Contribution, Evidence, SharingContext
from desim.robot.sharing.map_message import MapFormat, MapUpdate, MapUpdateParams
from desim.robot.sharing.rates import MERGING_HZ, REFRESH_PERIODS
from desim.units import NS_PER_S, Pace

_new = tuple.__new__  # a named tuple at half the price
_SIZE = MapUpdate._fields.index("size_bytes")  # what comes before it makes a Contribution


class OwnMaps:
    """Sends this robot's own evidence to the others every ``period`` if it changed, or when its
    strategy wants that, and merges
    the last update that came from each other robot, four times a second.

    With ``changed_tiles`` an update holds the tiles that changed since the last one sent. A robot
    that missed an update gets those tiles with their next change, or with the next complete update.
    The map topic is latched, as gmapping's is.
    """

    class Params(MapUpdateParams):
        """The form of the updates, and their period."""

        content: Literal["full", "changed_tiles"] = Field("full", description=(
            "full grids, or the tiles that changed since the last message (default: full in "
            "testbed, the paper; changed_tiles in field)"))
        period_ns: Pace | None = Field("5 s", description=(
            "(gmapping map_update_interval; null: only when the strategy wants to, share_map)"))

    def __init__(self, params: Params) -> None:
        self._params = params
        self._sent: Evidence | None = None  # all of the evidence at the last update
        self._period = -1  # the number of the present one
        self._complete_at = 0  # the period in which everything was sent last

    def start(self, context: SharingContext) -> None:
        self._codec = MapFormat(context.grid, self._params.content, self._params.encoding,
                                context.padding)
        context.advertise(latch=True, via=self._params.via)
        self._updates = context.latest()
        if self._params.period_ns is not None:
            context.every(self._params.period_ns, self._on_period)
        context.every(NS_PER_S // MERGING_HZ, self._merge)

    def share(self, context: SharingContext) -> None:
        """Send what is new now, between two periods."""
        self._on_period(context)

    def _on_period(self, context: SharingContext) -> None:
        self._period += 1
        pose = context.pose
        if pose is None or not context.has_subscribers():
            return
        layer = self._unsent(context.own())
        if layer is not None:
            context.publish(MapUpdate(context.name, context.now_ns, pose, layer,
                                      self._codec.size_bytes(layer)))

    def _unsent(self, known: Evidence) -> Evidence | None:
        """The evidence to send now, noted as sent; None if there is none."""
        sent = self._sent
        if sent is None:
            if not len(known.filled()):
                return None
        elif self._period - self._complete_at < REFRESH_PERIODS:
            changed = known.changed_since(sent)
            if not len(changed):
                return None
            if self._codec.content == "changed_tiles":
                self._sent = known
                return known.only(changed)
        self._sent, self._complete_at = known, self._period
        return known

    def _merge(self, context: SharingContext) -> None:
        """Take in all updates that have arrived since the last time."""
        news = self._updates.news()
        if news:
            context.take_in([_new(Contribution, message.content[:_SIZE]) for message in news])
