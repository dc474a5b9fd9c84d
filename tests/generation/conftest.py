import sys
from pathlib import Path

# Stubs are imported by name in worker processes, which inherit sys.path.
sys.path.insert(0, str(Path(__file__).parent))
