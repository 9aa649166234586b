"""Where data lies that is not part of the project; tests of it are left out where it is not."""

from pathlib import Path

SHARED = Path(__file__).parents[2] / "shared" / "data"
SAMPLES = SHARED / "samples"
