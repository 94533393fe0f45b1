"""Messages of strategies: any content, encoded when it is published."""

from __future__ import annotations

import json
import pickle
from typing import NamedTuple

from desim.errors import ModelError, described

_STRING_BYTES = 4  # std_msgs/String: the length in front of the text
# Bounds of one instant. Strategies that come with desim publish a few messages in one, and answer
# once; the kernel's own bound is twice this number of answers (``desim.engine.kernel.MAX_ROUNDS``).
_MOST_MESSAGES = 10_000
_MOST_ANSWERS = 500


class Encoded(NamedTuple):
    """A content as bytes, so that a later change of the publisher's object changes no message."""

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
            data = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
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


class MessageCount:
    """Counts the messages that a strategy publishes on one host in one instant, so that strategies
    that answer each other for ever do not hang a run."""

    def __init__(self) -> None:
        self._now_ns, self._messages = -1, 0

    def add(self, topic: str, now_ns: int, answers: int) -> None:
        """Count one more message. ``answers``: the messages of this instant that led to it, each an
        answer to the one before. Raises ``ModelError`` for too many."""
        self._messages = self._messages + 1 if now_ns == self._now_ns else 1
        self._now_ns = now_ns
        if self._messages > _MOST_MESSAGES or answers > _MOST_ANSWERS:
            raise ModelError(f"messages of one instant do not end (topic {topic!r}): do strategies "
                             "answer each message with another one?")
