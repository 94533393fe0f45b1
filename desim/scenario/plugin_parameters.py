"""The parameters of plug-ins are parsed here, from text with units to the plug-in's ``Params``.

Loading a scenario calls ``parse_parameters`` for each plug-in that the scenario chooses. From then
on the values travel: ``scenario.network.media["lan"].rules[0].params.rate_bps``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache

from desim import plugins
from desim.ports import Params

_REMEMBERED = 256  # parameter blocks: the scenarios of a campaign have most of them in common


def parse_parameters(kind: str, name: str, written: Mapping[str, object]) -> Params:
    """An instance of the plug-in's ``Params``, from the mapping that stands in a scenario.

    ``kind`` and ``name`` are those of ``plugins.load``. Raises ``InputError`` where there is no
    such plug-in, and pydantic's ``ValidationError`` for wrong parameters.
    """
    return _parsed(plugins.parameters(kind, name), json.dumps(written))


@lru_cache(_REMEMBERED)
def _parsed(block: type[Params], text: str) -> Params:
    # As JSON: strict about numbers, text and truth values, and a list may become a tuple.
    return block.model_validate_json(text, strict=True)
