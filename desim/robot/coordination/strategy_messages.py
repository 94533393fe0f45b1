"""Messages of strategies: any content, encoded when it is published."""

from __future__ import annotations

import json
import pickle
from typing import NamedTuple

from desim.errors import ModelError, described

_STRING_BYTES = 4  # std_msgs/String: the length in front of the text


class Encoded(NamedTuple):
    """A content as bytes: what the publisher does to its object later changes no message."""

    data: bytes
    is_json: bool
    size_bytes: int

    def decoded(self) -> object:
        """A copy of the content, each time a new one."""
        return json.loads(self.data) if self.is_json else pickle.loads(self.data)


def encoded(content: object, size_bytes: int | None) -> Encoded:
    """``content`` as JSON in a std_msgs/String, or pickled with the size that is declared. Raises
    ``ModelError`` for what cannot be encoded, and for a size that is none."""
    if size_bytes is None:
        try:
            data = json.dumps(content, separators=(",", ":")).encode()
        except (TypeError, ValueError) as error:
            raise ModelError(f"JSON cannot hold {content!r} ({described(error)}); "
                             "publish numbers, texts, lists and mappings of them, or give "
                             "size_bytes") from error
        return Encoded(data, True, _STRING_BYTES + len(data))
    if type(size_bytes) is not int or size_bytes < 0:
        raise ModelError(f"size_bytes is an int >= 0, not {size_bytes!r}")
    try:
        return Encoded(pickle.dumps(content), False, size_bytes)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        raise ModelError(f"{content!r} cannot be pickled ({described(error)})") from error
