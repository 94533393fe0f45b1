"""Map updates: what robots send each other about the world, and its form on the wire.

A ``MapUpdate`` carries its sender's own evidence by reference: in the simulation nobody has to
encode and decode it, but its size is that of the encoded form. All numbers are little-endian.

``full``: a nav_msgs/OccupancyGrid, byte for byte. Its cells are log-odds in the place of percents,
row by row from the lower left, padded with unknown ones. Its stamp is the version. Its info.origin,
which is common to the fleet, holds the sender's pose: x, y, and the yaw in the place of z. ``zlib``
compresses the cells.

``changed_tiles``: a header (version i64; x, y, yaw f64; number of tiles u16; whether these are all
that the sender knows, u8), then for each tile its number, u16, and its 1024 cells, i8. ``zlib``
compresses what follows the header.
"""

from __future__ import annotations

import math
import struct
import zlib
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from desim.middleware.contents import MAP_FRAME_BYTES
from desim.ports import GridSpec, Params, Pose2D
from desim.ports.sharing import Evidence
from desim.robot.mapping.tiles import CELLS, raster
from desim.units import NS_PER_S, Pace

ZLIB_LEVEL = 6  # zlib's own default

# seq, stamp, frame_id | map_load_time, resolution, width, height, origin | length of the cells
_GRID = struct.Struct(f"<III I{MAP_FRAME_BYTES}s IIfII 7d I")
_HEADER = struct.Struct("<qdddHB")
_TILE = np.dtype([("number", "<u2"), ("cells", "i1", CELLS)])


_NO_POSE = Pose2D(math.nan, math.nan, math.nan)  # on the wire, of a source that said none


class MapUpdate(NamedTuple):
    """The own evidence of robot ``source``, or its changed tiles, and the robot's pose.

    ``version`` is the source's clock in ns when ``layer`` was taken: it also grows when a robot
    starts again with empty memory.
    """

    source: str
    version: int
    pose: Pose2D | None
    layer: Evidence
    size_bytes: int


class MapUpdateParams(Params):
    """The form of the updates, and their period."""

    encoding: Literal["raw", "zlib"] = Field("raw", description=(
        "(default: raw in testbed, the paper; zlib in field)"))
    period_ns: Pace = Field("5 s", description="(gmapping map_update_interval)")
    via: Literal["unicast", "broadcast"] = Field("unicast", description="(the paper: TCPROS)")


class MapFormat(NamedTuple):
    """One form of map updates on the wire: ``content`` full or changed_tiles, ``encoding`` raw or
    zlib, on a grid that both sides know. ``padding``: unknown cells behind those of a full one."""

    spec: GridSpec
    content: str
    encoding: str
    padding: int = 0

    def size_bytes(self, layer: Evidence) -> int:
        """The length of ``encode`` for an update with this layer."""
        full = self.content == "full"
        header_bytes = (_GRID if full else _HEADER).size
        if self.encoding == "zlib":
            return header_bytes + len(zlib.compress(self._body(layer), ZLIB_LEVEL))
        if full:
            return header_bytes + self.spec.width * self.spec.height + self.padding
        return header_bytes + len(_named(layer)) * _TILE.itemsize

    def encode(self, update: MapUpdate) -> bytes:
        """The bytes of ``update``. Its source is not among them: that is the topic's name."""
        pose = update.pose or _NO_POSE
        body = self._body(update.layer)
        if self.content == "full":
            header = _GRID.pack(0, *divmod(update.version, NS_PER_S), MAP_FRAME_BYTES, b"", 0, 0,
                                self.spec.resolution_m, self.spec.width, self.spec.height, *pose,
                                0.0, 0.0, 0.0, 1.0, len(body))
        else:
            header = _HEADER.pack(update.version, *pose, len(_named(update.layer)),
                                  update.layer.complete)
        return header + (zlib.compress(body, ZLIB_LEVEL) if self.encoding == "zlib" else body)

    def _body(self, layer: Evidence) -> bytes:
        if self.content == "full":
            return raster(self.spec, layer.cells()).tobytes() + bytes(self.padding)
        named = _named(layer)
        entries = np.empty(len(named), _TILE)
        entries["number"] = named
        entries["cells"] = layer.cells()[np.isin(layer.tiles, named)]
        return entries.tobytes()


def _named(layer: Evidence) -> np.ndarray:
    """The numbers of the tiles that are sent: of a part also those that have become empty."""
    return layer.filled() if layer.complete else layer.tiles
