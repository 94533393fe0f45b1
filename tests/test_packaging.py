"""The package's descriptions of itself agree: its versions, its files, its type information."""

import os
import tarfile
import tomllib
import zipfile

import reproducible
import yaml

import desim


def project(repository):
    return tomllib.loads((repository / "pyproject.toml").read_text())


def test_one_version(repository):
    cited = yaml.safe_load((repository / "CITATION.cff").read_text())
    assert project(repository)["project"]["version"] == cited["version"] == desim.__version__


def test_all_files_that_are_not_python_are_package_data(repository):
    data = project(repository)["tool"]["setuptools"]["package-data"]
    named = {f"{package.replace('.', '/')}/{name}" for package, names in data.items()
             for name in names}
    found = {file.relative_to(repository).as_posix() for package in ("desim", "netmodels")
             for file in (repository / package).rglob("*")
             if file.is_file() and file.suffix not in (".py", ".pyc")}
    assert found == named
    assert {"desim/py.typed", "netmodels/py.typed"} <= found


def test_nothing_is_installed_that_nobody_imports(repository):
    distributions = {"pyyaml": "yaml", "pillow": "PIL"}  # where the module has another name
    text = "\n".join(file.read_text() for package in ("desim", "netmodels")
                     for file in (repository / package).rglob("*.py"))
    for requirement in project(repository)["project"]["dependencies"]:
        name = requirement.split(">")[0].lower()
        module = distributions.get(name, name)
        assert f"import {module}" in text or f"from {module}" in text, requirement


def test_files_of_two_builds_become_the_same(tmp_path):
    """Times, owners, modes and the order of an sdist differ before, and nothing after."""
    found = []
    for number, (mode, at_s) in enumerate([(0o600, 1e9), (0o664, 1.1e9)]):
        folder = tmp_path / str(number)
        folder.mkdir()
        for name in ("b.py", "a.py")[::1 - 2 * number]:
            (folder / name).write_text(name)
            (folder / name).chmod(mode | 0o100 * (name == "a.py"))
            os.utime(folder / name, (at_s, at_s))
        with zipfile.ZipFile(folder / "x.whl", "w") as archive:
            for name in "a.py", "b.py":
                archive.write(folder / name, name)
        with tarfile.open(folder / "x.tar.gz", "w:gz") as archive:
            for file in folder.glob("*.py"):
                archive.add(file, f"x/{file.name}")
        before = [(folder / name).read_bytes() for name in ("x.whl", "x.tar.gz")]
        reproducible.wheel(folder / "x.whl", 1_200_000_000)
        reproducible.sdist(folder / "x.tar.gz", 1_200_000_000)
        found.append((before, [(folder / name).read_bytes() for name in ("x.whl", "x.tar.gz")]))
    assert found[0][0] != found[1][0] and found[0][1] == found[1][1]
    with tarfile.open(tmp_path / "0" / "x.tar.gz") as archive:
        assert [(one.name, oct(one.mode), one.mtime) for one in archive] == [
            ("x/a.py", "0o755", 1_200_000_000), ("x/b.py", "0o644", 1_200_000_000)]
