"""The wheel carries the checkout's ``scenarios/`` as ``desim/scenarios``; all else is declared in
pyproject.toml. An editable install reads them where they are."""

from pathlib import Path
from shutil import copytree, ignore_patterns

from setuptools import setup
from setuptools.command.build_py import build_py


class WithScenarios(build_py):
    """Copies the scenarios beside the modules."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            copytree("scenarios", Path(self.build_lib, "desim", "scenarios"), dirs_exist_ok=True,
                     ignore=ignore_patterns("__pycache__"))


setup(cmdclass={"build_py": WithScenarios})
