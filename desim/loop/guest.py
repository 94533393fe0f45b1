"""The guest: a User-Mode Linux whose clock is simulated, in which an order is carried out.

Its clock moves only when everything in it sleeps (``time-travel=inf-cpu``, arch/um/Kconfig of
Linux): computing takes no time there, however long it takes here.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from desim.errors import InputError
from desim.loop import giving_way
from desim.loop.environment import KEPT, SYSTEM_PATH, path
from desim.loop.order import CONSOLE, OUTPUT, Order
from desim.scenario.schema.loop import Loop
from desim.scenario.schema.scenario import Scenario

START_S = 1_767_225_600  # its clock at boot: 1 January 2026, UTC
_OWN = ("/tmp", "/run", "/dev")  # where it has file systems of its own, in memory
_PASSED_ON = ("HOME", "NUMBA_CACHE_DIR", *KEPT)

_INIT = """#!/bin/sh
export PATH={path}
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t tmpfs run /run
mkdir -p /dev/pts /dev/shm /dev/net
mount -t devpts pts /dev/pts
mount -t tmpfs shm /dev/shm
[ -e /dev/net/tun ] || mknod /dev/net/tun c 10 200
[ -e /dev/fd ] || ln -s /proc/self/fd /dev/fd
mount -t tmpfs tmp /tmp
{mounts}
ip link set lo up
cd {here}
env {environment} {python} -P -m desim.loop.inside {folder} > {folder}/{output} 2>&1
sync
echo o > /proc/sysrq-trigger
sleep 10
"""


def boot(kernel: Path, order: Order, folder: Path, scenario: Scenario, memory_mb: int
         ) -> subprocess.Popen[bytes]:
    """Start the guest with the order in ``folder``, that of ``scenario``, where it leaves
    ``console`` and ``output``. Its random numbers have the scenario's seed. Raises ``InputError``
    where it would have to hide its own folders."""
    init = folder / "init"
    library = giving_way.build(folder)
    own = {} if library is None else {"LD_PRELOAD": str(library)}
    init.write_text(_init(order, folder, scenario.loop, {**os.environ, **own}), "utf-8")
    init.chmod(0o755)
    with (folder / CONSOLE).open("wb") as console:
        return subprocess.Popen(
            [kernel, f"mem={memory_mb}M", "root=/dev/root", "rootfstype=hostfs", "rootflags=/",
             "ro", f"init={init}", "time-travel=inf-cpu", f"time-travel-start={START_S}000000000",
             "con=null", "con0=null,fd:1", "quiet", "norandmaps", f"desim.seed={scenario.seed}",
             f"uml_dir={folder}", "umid=guest"],
            stdin=subprocess.DEVNULL, stdout=console, stderr=subprocess.STDOUT,
            start_new_session=True)


def _init(order: Order, folder: Path, loop: Loop, environ: Mapping[str, str]) -> str:
    """The script that the guest begins with."""
    written = {str(folder), os.path.abspath(order.out), environ["NUMBA_CACHE_DIR"]}
    read = [os.path.dirname(os.path.abspath(order.scenario)), sys.prefix, os.getcwd(),
            str(Path(__file__).parents[2]), *(program.folder for program in loop.programs)]
    hidden = {path for path in map(_hidden, (*sorted(written), *read)) if path is not None}
    mounts = [f"mkdir -p {(q := shlex.quote(path))}; mount -t hostfs none {q} "
              f"-o {'' if path in written else 'ro,'}{q}" for path in sorted(written | hidden)]
    passed_on = {**environ, "PATH": path(environ)}
    environment = [f"{name}={shlex.quote(passed_on[name])}"
                   for name in _PASSED_ON if name in passed_on]
    return _INIT.format(
        path=SYSTEM_PATH, output=OUTPUT, mounts="\n".join(mounts), here=shlex.quote(os.getcwd()),
        folder=shlex.quote(str(folder)), python=shlex.quote(sys.executable),
        environment=" ".join([*environment, "PYTHONHASHSEED=0", "PYTHONDONTWRITEBYTECODE=1"]))


def _hidden(path: str) -> str | None:
    """The whole of what is hidden with ``path`` of this machine, as what lies there names others:
    /tmp/a of /tmp/a/b. None unless the guest's own file systems lie over it."""
    if path in _OWN:
        raise InputError(f"{path} is a folder of the guest's own, in memory; allowed for scenarios "
                         f"and programs, and to start desim in: a folder below it, or elsewhere")
    own = next((own for own in _OWN if path.startswith(f"{own}/")), None)
    return None if own is None else "/".join(path.split("/")[:len(own.split("/")) + 1])
