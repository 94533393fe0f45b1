"""Random numbers by name: the same seed and name give the same numbers, in any order of asking.

Two kinds. ``streams("robot", 3, "odometry")`` is a generator for code that draws in sequence.
``streams.key("robot", 3, "lidar")`` is a key for counter-based noise inside kernels: value k of
the sequence is a pure function of (key, k): a reading that nobody uses costs nothing, and one more
draw moves nothing else.
"""

import hashlib

import numpy as np

from desim.errors import ModelError


def _digest(seed: int, use: str, name: tuple[str | int, ...]) -> bytes:
    for part in name:
        if type(part) not in (str, int):
            raise ModelError(f"a random stream's name consists of str and int, got {part!r} "
                             f"in {name!r}")
    # repr of the tuple joins injectively: ("a/b", "c") differs from ("a", "b/c"), 3 from "3".
    return hashlib.sha256(f"{seed}|{use}|{name!r}".encode()).digest()


class Streams:
    """Random generators and noise keys by name, derived from one seed (any int >= 0)."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self._made: dict[bytes, np.random.Generator] = {}

    def __call__(self, *name: str | int) -> np.random.Generator:
        """The PCG64 generator of this name; asking again gives the same object.

        Raises ``ModelError`` for a name of anything but str and int, here and below: a numpy
        integer would compare equal to an int and yet be spelled differently.
        """
        digest = _digest(self.seed, "generator", name)
        made = self._made.get(digest)
        if made is None:
            words = np.frombuffer(digest, dtype="<u4").tolist()
            made = self._made[digest] = np.random.Generator(
                np.random.PCG64(np.random.SeedSequence(words)))
        return made

    def key(self, *name: str | int) -> int:
        """A 64-bit key for counter-based noise, as an int below 2**64."""
        return int.from_bytes(_digest(self.seed, "key", name)[:8], "little")

    def integer(self, below: int, *name: str | int) -> int:
        """One number in [0, below), a pure function of seed and name: start phases, offsets."""
        return int.from_bytes(_digest(self.seed, "integer", name)[:16], "little") % below
