"""System tests share what the acceptance runs look with: how deep bodies are in matter."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))
