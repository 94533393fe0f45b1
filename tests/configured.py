"""Parameters of a plug-in with single constants changed."""

from __future__ import annotations

import inspect

from desim.ports import Params, yaml_key


def configured(block, **given):
    """An instance of ``block``; values that are no keys of its own are those of its constants."""
    return block(**_placed(block, given))


def _placed(block, given):
    kinds = {yaml_key(name): info.annotation for name, info in block.model_fields.items()}
    own = {key: _placed(kinds[key], value) if isinstance(value, dict) and is_block(kinds[key])
           else value for key, value in given.items() if key in kinds}
    constants = {key: value for key, value in given.items() if key not in kinds}
    return {**own, **({"constants": constants} if constants else {})}


def is_block(kind):
    """Whether a parameter's type is a block of parameters."""
    return inspect.isclass(kind) and issubclass(kind, Params)
