"""Plays the scenarios of real programs twice at once, and compares the digests.

    python tools/loop_twice.py

A scenario whose programs are not installed here is skipped, and the reason said.
"""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

SCENARIOS = Path(__file__).parent.parent / "scenarios" / "loop"
DESIM = Path(sys.executable).with_name("desim")
ROSPY = "import rospy, rosmaster, sensor_msgs, nav_msgs, tf2_msgs, std_msgs"
# The interpreter and the modules that the programs of each scenario need.
NEEDS = {"ros1_chatter": ("/usr/bin/python3", ROSPY), "mixed_fleet": ("/usr/bin/python3", ROSPY),
         "ros1_goals": ("/usr/bin/python3", ROSPY),
         "ros2_field": (sys.executable, "import cyclonedds"),
         "cyclone_chatter": (sys.executable, "import cyclonedds"),
         "zenoh_chatter": (sys.executable, "import zenoh")}


def lacking(name: str) -> str:
    """The reason why a scenario cannot run here; empty if it can."""
    python, modules = NEEDS[name]
    tried = subprocess.run([python, "-c", modules], capture_output=True, text=True, check=False)
    return tried.stderr.strip().rpartition("\n")[2] if tried.returncode else ""


def digest(name: str, folder: Path) -> str:
    """The digest of 20 s of a scenario."""
    subprocess.run([DESIM, "loop", SCENARIOS / f"{name}.yaml", "--quiet", "--until", "20 s",
                    "--out", folder], check=True)
    (manifest,) = folder.glob("*/*/manifest.json")
    return json.loads(manifest.read_text("utf-8"))["digest"]


def main() -> int:
    """Return 1 if two runs of a scenario differ."""
    differ = 0
    for name in NEEDS:
        if reason := lacking(name):
            print(f"{name}: skipped, {reason}")
            continue
        with TemporaryDirectory() as home, ThreadPoolExecutor() as both:
            digests = list(both.map(digest, [name] * 2, [Path(home) / "1", Path(home) / "2"]))
        same = len(set(digests)) == 1
        differ |= not same
        print(f"{name}: {'equal' if same else 'DIFFERENT'}: {' '.join(digests)}", flush=True)
    return differ


if __name__ == "__main__":
    sys.exit(main())
