"""Pictures as files: png, pdf or svg, by the file's ending."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from desim.errors import InputError
from desim.files import target

ENDINGS = (".png", ".pdf", ".svg")


def save(figure: Figure, path: Path) -> None:
    """Write ``figure``. Raises ``InputError`` as ``check_ending`` does, and for a file that cannot
    be written."""
    check_ending(path)
    with target(path, "--to") as beside:
        figure.savefig(beside, format=path.suffix[1:].lower())


def check_ending(path: Path) -> None:
    """Refuse an ending that is no picture's. Raises ``InputError``."""
    if path.suffix.lower() not in ENDINGS:
        raise InputError(f"--to: {path} does not end like a picture; allowed: {', '.join(ENDINGS)}")
