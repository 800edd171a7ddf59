"""The tables of Joshi and Owis for the nonlinear optimal laws, printed beside ours.

Every module here with a `section` writes its part of `seeds.md`, in order of their names. `main` returns the
number of figures outside their tolerance.
"""

import importlib
import pkgutil
from pathlib import Path

from verification.figure import TABLE, Figure, failures

HEADING = """# The seeds' nonlinear optimal laws

Written by `verification/seeds/`. Where printed and ours differ, the reason stands beside the table; a printed
figure is never a goal that ours is bent towards. Joshi's units, km and s, in his tables; SI otherwise.
"""


def main(directory: Path) -> int:
    """Write the page and its plots; return how many figures are outside their tolerance."""
    directory.mkdir(parents=True, exist_ok=True)
    text, figures = [HEADING], list[Figure]()
    for name in sorted(module.name for module in pkgutil.iter_modules(__path__)):
        section = getattr(importlib.import_module(f"{__name__}.{name}"), "section", None)
        if section is not None:
            print(f"  {name} ...", flush=True)
            part, limits = section(directory)
            text.append(part + "\n".join(["", TABLE, *(figure.row for figure in limits), ""]))
            figures += limits
    (directory / "seeds.md").write_text("\n".join(text))
    return failures(figures)
