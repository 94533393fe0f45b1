"""The designs in docs/campaigns.md are right, and their metrics exist."""

import re
import shutil

import pytest

from desim.campaign.design.design import load_design
from desim.campaign.design.metrics import Metrics
from desim.campaign.design.plan import Plan

COUNTS = {"beams": 6, "shapes": 3 * 4 * 3 * 2 * 2, "until": 1}


@pytest.mark.parametrize("name", COUNTS)
def test_design(repository, tmp_path, name):
    text = (repository / "docs" / "campaigns.md").read_text()
    shutil.copy(repository / "scenarios" / "hello.yaml", tmp_path)
    block, = (found for found in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
              if found.startswith(f"name: {name}\n"))
    (tmp_path / "design.yaml").write_text(block)
    plan = Plan(load_design(tmp_path / "design.yaml"))
    assert len(plan.vectors) == COUNTS[name]
    Metrics(plan)
