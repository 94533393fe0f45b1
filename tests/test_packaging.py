"""The package's descriptions of itself agree: its versions, its files, its type information."""

import tomllib

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
