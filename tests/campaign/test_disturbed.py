"""A campaign, its workers and its disk are killed; the tool does it twenty times."""

import subprocess
import sys


def test_a_disturbed_campaign_ends_as_an_undisturbed_one(repository):
    done = subprocess.run(
        [sys.executable, str(repository / "tools" / "disturb.py"), "--times", "3", "--runs", "12"],
        capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "the same runs.parquet"
