"""Pages for a browser, opened where there is a screen."""

from __future__ import annotations

import os
import sys
import webbrowser


def open_page(url: str) -> None:
    """Open a page if somebody sits at a terminal of a computer that can open a window."""
    windows = sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    if windows and is_terminal():
        webbrowser.open(url)


def is_terminal() -> bool:
    """Whether somebody reads what is printed as it comes."""
    return sys.stdout.isatty()
