"""TAPs: interfaces of the programs' side whose frames this process reads and writes."""

from __future__ import annotations

import fcntl
import os
import struct
import subprocess
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from desim.errors import InputError
from desim.loop.addresses import Address

# linux/if_tun.h
_TUNSETIFF, _IFF_TAP, _IFF_NO_PI = 0x400454CA, 0x0002, 0x1000
MAX_FRAME_BYTES = 1514  # Ethernet without its check sequence


class HostTap(NamedTuple):
    """The interface of one host to one medium. ``descriptor``: of its frames."""

    address: Address
    descriptor: int

    def read(self) -> bytes | None:
        """A frame that a program sent, from its destination address on; None if there is none."""
        try:
            return os.read(self.descriptor, MAX_FRAME_BYTES)
        except BlockingIOError:
            return None

    def write(self, frame: bytes) -> bool:
        """Hand a frame to the programs. Returns False if the interface cannot take it."""
        try:
            os.write(self.descriptor, frame)
        except OSError:
            return False
        return True


def opened(hosts: Mapping[int, Sequence[Address]], names: Sequence[str]) -> list[HostTap]:
    """A network namespace for each of ``hosts`` (index to addresses), called as in ``names``, and
    in it a TAP for each address. Raises ``InputError`` where the system refuses."""
    taps, commands = [], []
    try:
        for host, addresses in hosts.items():
            commands.append(f"netns add {names[host]}")
            for own in addresses:
                taps.append(HostTap(own, _new(name := f"d{own.medium}x{own.host}")))
                commands.append(f"link set {name} netns {names[host]} name {own.interface}")
    except OSError as error:
        raise InputError(f"/dev/net/tun: {error.strerror}; real programs need TAP interfaces: "
                         "desim loop doctor says what is missing") from error
    _ip(commands)
    for host, addresses in hosts.items():
        _ip(["link set lo up", *(line for own in addresses for line in (
            f"link set {own.interface} address {own.mac.hex(':')} up multicast on",
            f"address add {own.ip}/16 broadcast + dev {own.interface}")),
            f"route add 224.0.0.0/4 dev {addresses[0].interface}"], names[host])
    return taps


def _new(name: str) -> int:
    descriptor = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    fcntl.ioctl(descriptor, _TUNSETIFF,
                struct.pack("16sH22x", name.encode(), _IFF_TAP | _IFF_NO_PI))
    return descriptor


def _ip(commands: Sequence[str], namespace: str | None = None) -> None:
    """Give iproute2 these commands, in a namespace."""
    within = [] if namespace is None else ["-netns", namespace]
    done = subprocess.run(["ip", *within, "-batch", "-"], input="\n".join(commands), text=True,
                          capture_output=True, check=False)
    if done.returncode:
        raise InputError(f"ip: {done.stderr.strip()}")
