"""The memory that the report of a campaign with many vectors takes."""

import subprocess
import sys
from pathlib import Path

_MADE = """\
import sys
from pathlib import Path
from synthetic import campaign, design, timed
from desim.report.campaign.campaign_report import write

folder = Path(sys.argv[1])
parameters = {"range": list(range(1, 1001)), "strategy": ["near", "far"]}
campaign(folder, parameters, 2, lambda levels, iteration: timed(100.0 + levels["range"] % 7,
                                                                explored=0.99, delivered=0.5))
write(folder, design(parameters))
print(*(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def test_two_thousand_vectors_take_less_than_500_mb(tmp_path):
    """Two lines of a thousand values: knees are looked for between all pairs of many places."""
    done = subprocess.run([sys.executable, "-c", _MADE, str(tmp_path)], check=True, text=True,
                          capture_output=True, cwd=Path(__file__).parent)
    assert (tmp_path / "report" / "report.html").exists()
    assert 0 < int(done.stdout) < 500_000, "kB at the most, everything that is imported included"
