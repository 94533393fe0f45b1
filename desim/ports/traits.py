"""The traits of plug-ins: what a class declares of itself, in one value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from desim.errors import did_you_mean


@dataclass(frozen=True, kw_only=True)
class Traits:
    """Base of the traits of strategies, map sharing, localization and tasks. A class declares them
    in one line, ``traits = StrategyTraits(reads_team_state=True)``; what it leaves out has the
    default. Raises ``TypeError`` for an unknown name or a value of another type."""

    def __new__(cls, **given: object) -> Self:
        known = cls.__dataclass_fields__
        for name, value in given.items():
            if name not in known:
                raise TypeError(f"{cls.__name__} has no {name!r}{did_you_mean(name, known)}; "
                                f"known: {', '.join(known)}")
            wanted = type(known[name].default)
            if not isinstance(value, wanted):
                raise TypeError(f"{name} of {cls.__name__} is a {wanted.__name__}, not {value!r}")
        return super().__new__(cls)

    @classmethod
    def of(cls, plugin: object) -> Self:
        """The traits of a plug-in or of its class; the defaults if it declares none."""
        declared: Self | None = getattr(plugin, "traits", None)
        return cls() if declared is None else declared
