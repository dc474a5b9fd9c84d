"""Lets the tests of this folder import their oracles and hand-made houses."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
