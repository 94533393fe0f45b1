"""The memory of a computer: what its processes take, and its limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

from desim.errors import ModelError, method_of
from desim.ports.computers import Kept, MemoryModel


@dataclass(frozen=True, slots=True)
class Memory:
    """The memory that processes take by ``model``, and ``limit_bytes`` (None: there is no limit).
    Raises ``ModelError`` for an answer that is no int >= 0."""

    model: MemoryModel
    limit_bytes: int | None

    def system_bytes(self) -> int:
        """See ``MemoryModel.system_bytes``."""
        size_bytes = self.model.system_bytes()
        return size_bytes if _is_size(size_bytes) else self._refuse(size_bytes, "system_bytes")

    def process_bytes(self, kept: Kept) -> int:
        """See ``MemoryModel.process_bytes``."""
        size_bytes = self.model.process_bytes(kept)
        return size_bytes if _is_size(size_bytes) else self._refuse(size_bytes, "process_bytes",
                                                                    f" to {kept}")

    def _refuse(self, answer: object, method: str, asked: str = "") -> NoReturn:
        raise ModelError(f"{method_of(self.model, method)} answered {answer!r}{asked}; wanted: an "
                         "int >= 0, in bytes")


def _is_size(answer: object) -> bool:
    return type(answer) is int and answer >= 0
