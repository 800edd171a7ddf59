"""`python -m verification.faults [FORMATION or LAW ...]`."""

import sys
from pathlib import Path

from verification.faults import main

sys.exit(main(Path("docs/verification"), sys.argv[1:]) > 0)
