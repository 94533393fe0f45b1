"""The environment of real programs: names, addresses, and what middlewares read from variables."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from desim.loop.addresses import Address

KEPT = ("PATH", "LANG", "PYTHONPATH", "LD_LIBRARY_PATH", "ROS_DISTRO", "ROS_ROOT",
        "ROS_PACKAGE_PATH", "ROS_ETC_DIR", "CMAKE_PREFIX_PATH", "AMENT_PREFIX_PATH",
        "RMW_IMPLEMENTATION", "LD_PRELOAD")  # of the user's own
SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"  # ip is in sbin
_MASTER_PORT = 11311  # ROS 1


def environment(host: str, addresses: Sequence[Address], home: Path, master: Address | None,
                dds_domain: int | None, user: Mapping[str, str] = os.environ) -> dict[str, str]:
    """The variables of the programs on ``host``, whose first interface is what ROS 1 and Cyclone
    DDS use."""
    first = addresses[0]
    ros = {} if master is None else {"ROS_MASTER_URI": f"http://{master.ip}:{_MASTER_PORT}"}
    domain = {} if dds_domain is None else {"ROS_DOMAIN_ID": str(dds_domain)}
    return {
        **{name: user[name] for name in KEPT if name in user},
        "HOME": str(home), "DESIM_HOST": host, "DESIM_IP": first.ip,
        "DESIM_PYTHON": sys.executable,
        "PYTHONHASHSEED": "0", "PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1",
        "ROS_IP": first.ip, "ROS_LOG_DIR": str(home / "ros"), **ros, **domain,
        "CYCLONEDDS_URI": (
            "<CycloneDDS><Domain><General><Interfaces>"
            f'<NetworkInterface name="{first.interface}"/></Interfaces></General></Domain>'
            "</CycloneDDS>")}


def path(user: Mapping[str, str]) -> str:
    """The user's PATH, and behind it where the system's own programs are."""
    return f"{user['PATH']}:{SYSTEM_PATH}" if user.get("PATH") else SYSTEM_PATH


def hosts_file(addresses: Mapping[str, Sequence[Address]]) -> str:
    """The text of /etc/hosts: each host by its name, with its address on its first medium."""
    return "".join(["127.0.0.1 localhost\n",
                    *(f"{own[0].ip} {host}\n" for host, own in addresses.items())])
