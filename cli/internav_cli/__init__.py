"""The command line: click, thin, no logic."""

import sys
from importlib.util import find_spec

if find_spec("click") is None:  # the loader alone is installed
    sys.exit("the commands need click: pip install 'internav-data[generate]'")
