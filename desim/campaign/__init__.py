"""Many runs to one question: designs, the runs that they ask for, and how these are carried out.

``desim.campaign(path)`` reads a campaign: this package can be called.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from desim.api import Campaign


class _Callable(ModuleType):
    # Whoever imports a module of this package puts the package in place of a function of its name.
    def __call__(self, path: str | Path) -> Campaign:
        """The campaign in a folder. Raises ``InputError`` where there is none."""
        from desim.api import Campaign

        return Campaign(path)


sys.modules[__name__].__class__ = _Callable
