"""Images of ground as cells of grey, read with limits."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from io import BufferedReader
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from desim.errors import InputError
from desim.world.terrain import MAX_CELLS

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

MOST_BYTES = 400_000_000
_FORMATS = ("PPM", "PNG", "BMP", "JPEG", "TIFF")  # Pillow reads others by other programs


class MapImage(NamedTuple):
    """An image: ``cells`` [rows, cols], top row first, of greys by number; ``values`` of all
    greys, 0 to 255."""

    path: Path
    cells: np.ndarray
    values: np.ndarray


@contextmanager
def opened(path: Path, opening: AbstractContextManager[BufferedReader]) -> Iterator[Picture]:
    """A picture of at most ``MAX_CELLS`` pixels. Raises ``InputError``, also for what goes wrong
    while it is read, and ``FileNotFoundError``."""
    from PIL import Image, UnidentifiedImageError

    try:
        with opening as file, Image.open(file, formats=_FORMATS) as image:
            if image.width * image.height > MAX_CELLS:
                raise InputError(f"{path}: {image.width} x {image.height} pixels are too many "
                                 f"(allowed: {MAX_CELLS})")
            yield image
    except FileNotFoundError:
        raise
    except UnidentifiedImageError:
        raise InputError(f"{path}: cannot be read as an image: cannot identify image file "
                         f"{str(path)!r}") from None
    except (OSError, SyntaxError, ValueError,
            Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read as an image: {reason}") from None


def greys(path: Path, image: Picture) -> MapImage:
    """The greys of a picture, in a coloured one the mean of the channels, without transparency.
    Raises ``InputError`` for an empty one."""
    sixteen_bits = image.mode.startswith("I")
    pixels = np.asarray(image if sixteen_bits or image.mode == "L" else image.convert("RGB"))
    if pixels.size == 0:
        raise InputError(f"{path}: the image is empty")
    if pixels.ndim == 3:  # the mean of the channels
        return MapImage(path, pixels.sum(axis=2, dtype=np.uint16), np.arange(3 * 255 + 1) / 3.0)
    if sixteen_bits:
        return MapImage(path, pixels.clip(0, 65535).astype(np.uint16), np.arange(65536) / 257.0)
    return MapImage(path, pixels, np.arange(256.0))


def open_edge(path: Path, free: np.ndarray) -> list[str]:
    """A sentence if there are ``free`` [rows, cols] cells at the edge of the file ``path``."""
    rim = int(free.sum() - free[1:-1, 1:-1].sum())
    return [f"{rim} free cells lie at the edge of {path.name}, which is closed by a wall there"
            ] if rim else []
