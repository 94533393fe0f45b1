"""The memory of a computer: what its processes take, and its limit."""

from __future__ import annotations

from dataclasses import dataclass

from desim.errors import ModelError, class_of
from desim.ports.computers import Kept, MemoryModel


@dataclass(frozen=True, slots=True)
class Memory:
    """So much as ``model`` says, checked: ``ModelError`` for what is no int >= 0. ``limit_bytes``
    None: there is no limit."""

    model: MemoryModel
    limit_bytes: int | None

    def system_bytes(self) -> int:
        """See ``MemoryModel.system_bytes``."""
        return self._checked(self.model.system_bytes(), "system_bytes()")

    def process_bytes(self, kept: Kept) -> int:
        """See ``MemoryModel.process_bytes``."""
        return self._checked(self.model.process_bytes(kept), f"process_bytes({kept})")

    def _checked(self, size_bytes: object, asked: str) -> int:
        if type(size_bytes) is int and size_bytes >= 0:
            return size_bytes
        raise ModelError(f"{class_of(self.model)} answered {size_bytes!r} to {asked}; wanted: an "
                         "int >= 0, in bytes")
