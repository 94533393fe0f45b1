"""The addresses of hosts with real programs, one for each medium that a host is attached to."""

from __future__ import annotations

from typing import NamedTuple

MAX_HOSTS = 65_534  # of a network with 16 bits for hosts
MAX_MEDIA = 100
_FIRST_NETWORK = 77  # 10.77.0.0/16 for the first medium


class Address(NamedTuple):
    """The interface of host number ``host`` to medium number ``medium``, both from 0."""

    medium: int
    host: int

    @property
    def ip(self) -> str:
        """10.77.0.1 is that of the first host on the first medium."""
        high, low = divmod(self.host + 1, 256)
        return f"10.{_FIRST_NETWORK + self.medium}.{high}.{low}"

    @property
    def mac(self) -> bytes:
        """A locally administered address, which ends in the numbers of medium and host."""
        return bytes((2, 0, 0, self.medium)) + self.host.to_bytes(2, "big")

    @property
    def interface(self) -> str:
        """The name of the interface: eth0 is that to the first medium."""
        return f"eth{self.medium}"


def host_of(mac: bytes) -> int | None:
    """The host whose interface has this address; None if it is none of ours."""
    return int.from_bytes(mac[4:6], "big") if mac[:3] == b"\x02\x00\x00" else None


def is_group(mac: bytes) -> bool:
    """Whether the address is that of a broadcast or a multicast (IEEE 802.3, 3.2.3)."""
    return bool(mac[0] & 1)
