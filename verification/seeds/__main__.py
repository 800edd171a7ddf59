"""Accept the figures of the pages of the seeds as they come out now, of all parts or of those named."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from verification.figure import Cell
from verification.seeds import parts
from verification.seeds.accepted import accept

if __name__ == "__main__":
    for name, section in parts().items():
        if name in (sys.argv[1:] or parts()):
            with TemporaryDirectory() as nowhere:
                _, figures = section(Path(nowhere))
            accept(name, [figure for figure in figures if isinstance(figure, Cell)])
