"""docs/in-your-ci.md: its tests pass as they stand there, and its workflow is one."""

import re
import subprocess
import sys

import pytest
import yaml

import desim


@pytest.fixture
def page(repository):
    return (repository / "docs" / "in-your-ci.md").read_text()


def test_its_tests_pass(page, repository, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hello = (repository / "scenarios" / "hello.yaml").read_text()
    (tmp_path / "hello.yaml").write_text(hello)
    digest = desim.run("hello.yaml", overrides=["stop.elapsed=10 s"]).manifest["digest"]
    (tmp_path / "test_fleet.py").write_text("\n".join(
        re.findall(r"```python\n(.*?)```", page, re.DOTALL)).replace("DIGEST", digest))
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "--tb=short"], text=True,
                          capture_output=True, check=False)
    assert done.returncode == 0 and "...." in done.stdout, done.stdout


def test_its_workflow_is_one(page):
    workflow = yaml.load(re.search(r"```yaml\n(.*?)```", page, re.DOTALL)[1], yaml.BaseLoader)
    steps = workflow["jobs"]["fleet"]["steps"]
    assert [*workflow] == ["name", "on", "jobs"]
    assert all(len({"uses", "run"} & {*step}) == 1 for step in steps)
    assert steps[-1] == {"run": "pytest tests"}
