"""Let every test import the helpers of tests/physics (`oracle`, `prescriptions`) by name."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "physics"))
