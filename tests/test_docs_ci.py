"""docs/in-your-ci.md: its tests pass as they stand there, and its workflow is one."""

import re

import pytest
import yaml

import desim

pytest_plugins = ["pytester"]


@pytest.fixture
def page(repository):
    return (repository / "docs" / "in-your-ci.md").read_text()


def test_its_tests_pass(page, repository, pytester):
    hello = (repository / "scenarios" / "hello.yaml").read_text()
    (pytester.path / "hello.yaml").write_text(hello)
    digest = desim.run("hello.yaml", overrides=["stop.elapsed=10 s"]).manifest["digest"]
    pytester.makepyfile("\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)).replace(
        "DIGEST", digest))
    pytester.runpytest_subprocess().assert_outcomes(passed=4)


def test_its_workflow_is_one(page):
    workflow = yaml.load(re.search(r"```yaml\n(.*?)```", page, re.DOTALL)[1], yaml.BaseLoader)
    steps = workflow["jobs"]["fleet"]["steps"]
    assert [*workflow] == ["name", "on", "jobs"]
    assert all(len({"uses", "run"} & {*step}) == 1 for step in steps)
    assert steps[-1] == {"run": "pytest tests"}
