"""Compile all kernels of desim and netmodels into a folder, for a wheel.

    python tools/compile_kernels.py FOLDER

They are those of the checkout in which this file is. The machine code is for x86-64-v3.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def main(folder: Path) -> None:
    """Compile into ``folder``, which is made."""
    sys.path.insert(0, str(ROOT))
    from desim.compiler.machine_code import SHIPPED_CPU

    # numba reads it when it is imported, which a kernel does that is compiled
    os.environ |= {"NUMBA_CPU_NAME": SHIPPED_CPU, "NUMBA_CPU_FEATURES": ""}
    from desim.compiler import store
    from desim.compiler.kernel import kernels_of

    for name in modules_of_kernels(ROOT):
        import_module(name)
        if called := [kernel for kernel in kernels_of(name).values() if not kernel.is_inner]:
            store.ship(called, folder)


def modules_of_kernels(root: Path) -> list[str]:
    """The modules below ``root`` that declare kernels."""
    sources = [path for package in ("desim", "netmodels")
               for path in sorted((root / package).rglob("*.py"))
               if path.name == "kernels.py" or path.parent.name == "kernels"]
    names = [".".join(path.relative_to(root).with_suffix("").parts) for path in sources]
    return [name.removesuffix(".__init__") for name in names]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
