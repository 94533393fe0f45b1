"""The wheel carries the checkout's ``scenarios/`` as ``desim/scenarios``, and the compiled kernels
in the folder ``DESIM_KERNELS`` (``tools/compile_kernels.py``); all else is declared in
pyproject.toml. An editable install reads scenarios where they are, and compiles its kernels."""

import os
from pathlib import Path
from shutil import copytree, ignore_patterns

from setuptools import setup
from setuptools.command.build_py import build_py


class WithMore(build_py):
    """Copies scenarios and kernels beside the modules."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            if kernels := os.environ.get("DESIM_KERNELS"):
                copytree(kernels, Path(self.build_lib, "desim", "compiler", "shipped"))
            copytree("scenarios", Path(self.build_lib, "desim", "scenarios"), dirs_exist_ok=True,
                     ignore=ignore_patterns("__pycache__"))


setup(cmdclass={"build_py": WithMore})
