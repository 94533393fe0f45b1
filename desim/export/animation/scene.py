"""The scene of a run at an instant, drawn as a small picture from above."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFilter, ImageFont
from scipy.ndimage import median_filter

from desim import colours
from desim.export.extent import Extent, extent_of
from desim.export.link_loads import LinkLoads
from desim.monitor.map_growth import TENTH_NS
from desim.monitor.recorder import StandingWall
from desim.results.file_names import SAMPLES
from desim.results.merged_map import merged
from desim.results.recording import Recording
from desim.results.samples import measured
from desim.scenario.robot_types import types_of
from desim.scenario.schema.fleet import BodyType
from desim.units import MM_PER_M, NS_PER_S

_SIDE_PX, _BAR_PX, _MARGIN_PX = 600, 44, 10
_FINE = 2  # drawn so much larger, then shrunk: smooth edges
_TRAIL_NS = 6 * NS_PER_S
_GLOW_TENTHS = 20  # for which what was just explored stands out
_PAPER, _UNKNOWN, _FREE = (colours.parsed(text) for text in ("#ffffff", "#d5dae1", "#fbfaf7"))
_INK, _FAINT = colours.parsed("#2b323c"), colours.parsed("#8a94a1")
_ROBOT_M, _LEAST_PX = 0.45, 5.0  # radius: so that robots of a large terrain are still seen
_MOST_TRAILS = 100
_MOST_TONES = 160
_SMOOTH_CELLS, _GAPS_CELLS = 13, 5


class AnimationScene:
    """Draws ``recording``: the terrain, what is explored in the colour of the robot that was there
    first, trails of the last 6 s, robots with their headings, and messages between them."""

    def __init__(self, recording: Recording) -> None:
        self._recording, self._walls = recording, recording.walls
        self._poses, self._loads = recording.poses, LinkLoads(recording)
        self._obstacles = recording.moving_obstacles
        count = len(recording.robots)
        self._colours = [colours.of_robot(number) for number in range(count)]
        self._bodies = types_of(recording.run.scenario.fleet)
        self._numbers = {name: number for number, name in enumerate(recording.robots)}
        self._frame()
        self._territory()
        run = recording.run
        times_s, shares = (measured(run.samples, "explored_union") if run.has(SAMPLES) else
                           (np.empty(0), np.empty(0)))
        self._explored = (times_s * NS_PER_S, shares) if len(times_s) else None

    def picture(self, time_ns: int) -> Image.Image:
        """The scene at ``time_ns``, RGB, about 640 pixels wide."""
        ground = self._ground(time_ns)
        image = Image.new("RGB", (self._width, self._height + _BAR_PX * _FINE), _bytes(_PAPER))
        image.paste(ground, (0, 0))
        over = Image.new("RGBA", image.size, (0, 0, 0, 0))
        draw = ImageDraw.Draw(over)
        self._draw_messages(draw, time_ns)
        self._draw_trails(draw, time_ns)
        self._draw_walls(draw, time_ns)
        self._draw_robots(draw, time_ns)
        self._draw_bar(draw, time_ns)
        image.paste(over, (0, 0), over)
        return image.resize((image.width // _FINE, image.height // _FINE), Image.Resampling.BOX)

    def palette(self) -> list[int]:
        """Red, green and blue of up to 256 colours: those of the scene, where they are not too
        many, and the most frequent ones of its end."""
        tones = [colour for shades in (
            (_PAPER, _UNKNOWN, _FREE, _INK, _FAINT, colours.BUSY), self._colours,
            self._tint.tolist(), self._glow.tolist()) for colour in shades]
        own = [part for colour in tones[:_MOST_TONES] for part in _bytes(colour)]
        rest = 256 - len(own) // 3
        end = self.picture(self._recording.end_ns).quantize(rest, Image.Quantize.MEDIANCUT)
        return own + (end.getpalette() or [])[:3 * rest]

    def _frame(self) -> None:
        """The part of the plane that is shown, and its scale."""
        extent = extent_of(self._recording) or Extent(0.0, 0.0, 1.0, 1.0)
        size_m = np.maximum((extent.right_m - extent.left_m, extent.top_m - extent.bottom_m), 1.0)
        side_px = (_SIDE_PX - 2 * _MARGIN_PX) * _FINE
        self._px_per_m = side_px / size_m.max()
        wide, high_px = (size_m * self._px_per_m + 2 * _MARGIN_PX * _FINE).astype(int).tolist()
        self._width, self._height = wide + wide % 2, high_px + high_px % 2
        self._corner_m = np.array([extent.left_m, extent.bottom_m + size_m[1]])

    def _px(self, places_m: np.ndarray) -> np.ndarray:
        """[n, 2] pixels of places [n, 2] in m."""
        return (places_m - self._corner_m) * (self._px_per_m, -self._px_per_m) \
            + _MARGIN_PX * _FINE

    def _territory(self) -> None:
        """Since when some robot knows a cell (tenths of a second), and which one knew it first."""
        growths = self._recording.growths
        self._known_since: np.ndarray | None = None
        if growths:
            self._known_since, self._discoverer, _ = merged(growths, self._recording.robots)
        if self._known_since is not None and self._colours:
            self._discoverer = _smoothed(self._discoverer, len(self._colours))
            self._known_since = median_filter(self._known_since, _GAPS_CELLS)
        shades = self._colours or [_FREE]
        self._tint = np.array([colours.between(_FREE, shade, 0.20) for shade in shades])
        self._glow = np.array([colours.between(_FREE, shade, 0.50) for shade in shades])

    def _ground(self, time_ns: int) -> Image.Image:
        """Unknown and explored ground."""
        size = self._width, self._height
        if self._known_since is None:
            return Image.new("RGB", size, _bytes(_UNKNOWN))
        grid, tenths = self._recording.growths[0].grid, time_ns // TENTH_NS
        age = tenths - self._known_since.astype(np.int64)
        glow, tint = self._glow[self._discoverer], self._tint[self._discoverer]
        cells = np.where((age < 0)[..., None], _UNKNOWN,
                         np.where((age < _GLOW_TENTHS)[..., None], glow, tint))
        image = Image.fromarray((cells[::-1] * 255).astype(np.uint8))
        # The picture's corners in cells.
        left = (self._corner_m[0] - _MARGIN_PX * _FINE / self._px_per_m - grid.x_m)
        top = (grid.y_m + grid.height * grid.resolution_m
               - self._corner_m[1] - _MARGIN_PX * _FINE / self._px_per_m)
        scale = 1 / (self._px_per_m * grid.resolution_m)
        return image.transform(size, Image.Transform.AFFINE, (
            scale, 0, left / grid.resolution_m, 0, scale, top / grid.resolution_m),
            Image.Resampling.BILINEAR, fillcolor=_bytes(_UNKNOWN))

    def _draw_walls(self, draw: ImageDraw.ImageDraw, time_ns: int) -> None:
        width = max(2, round(0.22 * self._px_per_m))
        for wall in self._walls:
            if wall.from_ns <= time_ns < wall.until_ns:
                ends = self._px(_ends_m(wall))
                draw.line(_flat(ends), fill=_bytes(_INK), width=width)
                for x, y in ends.tolist():
                    draw.ellipse((x - width / 2, y - width / 2, x + width / 2, y + width / 2),
                                 fill=_bytes(_INK))

        at = min(int(np.searchsorted(self._poses.times_ns, time_ns)), len(self._obstacles) - 1)
        for x_mm, y_mm, radius_mm in self._obstacles[at].tolist() if at >= 0 else ():
            (x, y), = self._px(np.array([[x_mm, y_mm]]) / MM_PER_M).tolist()
            size = radius_mm / MM_PER_M * self._px_per_m
            draw.ellipse((x - size, y - size, x + size, y + size), fill=_bytes(_FAINT))

    def _draw_messages(self, draw: ImageDraw.ImageDraw, time_ns: int) -> None:
        """Lines between robots of which one has got messages of the other within this second."""
        places = self._px(self._poses.at(time_ns)[:, :2])
        pairs = {tuple(sorted((load.source, load.destination)))
                 for load in self._loads.at(-(-time_ns // NS_PER_S)) if load.messages}
        for one, other in sorted(pairs):
            if one in self._numbers and other in self._numbers:
                ends = places[[self._numbers[one], self._numbers[other]]]
                draw.line(_flat(ends), fill=(*_bytes(colours.BUSY), 45), width=_FINE)

    def _draw_trails(self, draw: ImageDraw.ImageDraw, time_ns: int) -> None:
        times_ns = self._poses.times_ns
        first, end = np.searchsorted(times_ns, [time_ns - _TRAIL_NS, time_ns], side="right")
        if len(self._colours) > _MOST_TRAILS or end - first < 2:
            return
        width = max(2, round(0.16 * self._px_per_m))
        for number, colour in enumerate(self._colours):
            way = self._px(self._poses.xy_mm[first:end, number] / MM_PER_M)
            draw.line(_flat(way), fill=(*_bytes(colour), 150), width=width, joint="curve")

    def _draw_robots(self, draw: ImageDraw.ImageDraw, time_ns: int) -> None:
        poses = self._poses.at(time_ns)
        least = max(_ROBOT_M * self._px_per_m, _LEAST_PX * _FINE)
        for (x, y), yaw, colour, body in zip(self._px(poses[:, :2]).tolist(), poses[:, 2].tolist(),
                                             self._colours, self._bodies, strict=True):
            radius = max(least, body.radius_m * self._px_per_m) if body.footprint else least
            for size, fill in ((radius + 1.5 * _FINE, _PAPER), (radius, colour)):
                _draw_body(draw, (x, y, yaw), size, body, _bytes(fill))
            tip = x + 0.85 * radius * np.cos(yaw), y - 0.85 * radius * np.sin(yaw)
            slim = radius * body.inscribed_radius_m / body.radius_m
            draw.line((x, y, *tip), fill=_bytes(_PAPER), width=max(2, round(slim / 3)))

    def _draw_bar(self, draw: ImageDraw.ImageDraw, time_ns: int) -> None:
        """Below the scene: the time, the share that is explored, and both as a line."""
        run, left = self._recording.run, _MARGIN_PX * _FINE
        right, y = self._width - left, self._height + 8 * _FINE
        draw.line((left, y, right, y), fill=_bytes(_UNKNOWN), width=3 * _FINE)
        news = f"{time_ns / NS_PER_S:.0f} s"
        if self._explored is not None:
            share = float(np.interp(time_ns, *self._explored))
            draw.line((left, y, left + (right - left) * share, y), fill=_bytes(colours.BUSY),
                      width=3 * _FINE)
            news += f"    {share:.0%} explored"
        text_y = y + 9 * _FINE
        draw.text((left, text_y), f"{run.manifest['name']}: {len(self._colours)} robots",
                  fill=_bytes(_INK), font=_font(15))
        draw.text((right, text_y), news, fill=_bytes(_INK), font=_font(15), anchor="ra")


def _draw_body(draw: ImageDraw.ImageDraw, at: tuple[float, float, float], size: float,
               body: BodyType, fill: tuple[int, int, int]) -> None:
    """A body that goes ``size`` pixels around the pose ``at``: x, y in pixels, yaw in rad."""
    x, y, yaw = at
    if not body.footprint:
        draw.ellipse((x - size, y - size, x + size, y + size), fill=fill)
        return
    c, s, scale = np.cos(yaw), np.sin(yaw), size / body.radius_m
    draw.polygon([(x + scale * (c * ahead - s * left), y - scale * (s * ahead + c * left))
                  for ahead, left in body.corners_m], fill=fill)


def _smoothed(discoverer: np.ndarray, robots: int) -> np.ndarray:
    """Territories without specks: robots that drive together see neighbouring cells by turns. More
    than 256 robots share colours."""
    image = Image.fromarray((discoverer % min(robots, 256)).astype(np.uint8))
    return np.asarray(image.filter(ImageFilter.ModeFilter(_SMOOTH_CELLS))).astype(np.int32)


def _ends_m(wall: StandingWall) -> np.ndarray:
    return np.array([(wall.x1_mm, wall.y1_mm), (wall.x2_mm, wall.y2_mm)]) / MM_PER_M


def _flat(places: np.ndarray) -> list[tuple[float, float]]:
    return [(x, y) for x, y in places.tolist()]


def _bytes(colour: Sequence[float]) -> tuple[int, int, int]:
    red, green, blue = (round(255 * part) for part in colour)
    return red, green, blue


@lru_cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    """matplotlib's own font, which is there wherever desim is."""
    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(str(file), size * _FINE)
