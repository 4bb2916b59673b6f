"""Is the correspondence right on real surfaces, how accurate, and next to what else? See `__main__`."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "solver"))  # as pytest does: `scans` imports `surfaces`
