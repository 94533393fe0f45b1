"""The materials of walls: names that terrains and radio models have in common.

``netmodels/radio/walls.py`` has how much of a radio wave each of them absorbs, and ``budget.py``
beside it takes that off the power at a receiver.
"""

from desim.errors import InputError, did_you_mean

# Name -> where its attenuation is published.
MATERIALS: dict[str, str] = {
    "brick": "ITU-R P.2040 (permittivity 3.75)",
    "concrete": "ITU-R P.2040 (permittivity 5.31); COST-231 external wall",
    "glass": "ITU-R P.2040 (permittivity 6.27)",
    "metal": "ITU-R P.2040 (conductor)",
    "plasterboard": "ITU-R P.2040 (permittivity 2.94); COST-231 light internal wall",
    "stone": "COST-231 external wall",
    "wood": "ITU-R P.2040 (permittivity 1.99); COST-231 external wall",
}

NAMES: tuple[str, ...] = tuple(MATERIALS)


def index(name: object, where: str) -> int:
    """The row in ``NAMES`` of a name that stands at the path ``where``. Raises ``InputError`` for
    an unknown material."""
    if name not in NAMES:
        raise InputError(f"{where}: unknown material {name!r}{did_you_mean(str(name), NAMES)}; "
                         f"allowed: {', '.join(NAMES)}")
    return NAMES.index(name)
