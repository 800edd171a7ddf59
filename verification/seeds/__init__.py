"""The figures and tables of the five documents, printed beside ours.

Every module here with a `section` writes its part of the page that it names (`PAGE`; else `seeds.md`), in order of
their names. `main` returns the number of figures outside their tolerance; `python -m verification.seeds` accepts the
figures as they are.
"""

import importlib
import pkgutil
from collections.abc import Callable
from pathlib import Path

from verification.figure import TABLE, Cell, Figure, failures

HEADING = """# The seeds' nonlinear optimal laws

Written by `verification/seeds/`. Where printed and ours differ, the reason stands beside the table; a printed
figure is never a goal that ours is bent towards. Joshi's units, km and s, in his tables; SI otherwise.

**Tolerances.** Every figure of ours is held to the one accepted last (`verification/seeds/accepted.csv`)
within 0.1 %, which is what the figures show here; of a state error, 0.1 % of the length of its position or
velocity, and 10 µm or 10 nm/s. Counts are held exactly; what else is held otherwise says so. Another
processor's arithmetic (OpenBLAS's kernels for Nehalem, NumPy without vector instructions, Numba for any
x86-64) uses up less than a hundredth of these; an identification time of the networks of 20.5 s instead of 20
takes 27 of the 90 figures of Table 8.2 out of theirs. A figure that is off stands below its table, and the
command fails. The tables of *figure, printed, ours* hold what the text claims, with the claim as tolerance.
"""

TOLERANCES = """
Written by `verification/seeds/`. Figures of ours in the tables that name none are held to those accepted last, as in
[seeds](seeds.md); the tables of *figure, printed, ours* hold what the document claims, with the claim as tolerance.
What no number and no scale is left of is shown by a picture of the same panels.
"""
HEADINGS = {
    "seeds": HEADING,
    "joshi": f"# Joshi: what the tables leave out\n{TOLERANCES}",
    "owis": f"# Owis: beyond the two transfers\n{TOLERANCES}",
    "neokleous": f"# Neokleous: the figures of the thesis\n{TOLERANCES}",
    "roberts": f"# Roberts: the figures of the paper\n{TOLERANCES}",
    "kremmydas": f"# Kremmydas: acquisitions and cost\n{TOLERANCES}",
}
"""Pages, by the name that a part gives as `PAGE`."""

Section = Callable[[Path], tuple[str, list[Figure]]]


def parts() -> dict[str, Section]:
    """What writes the parts of the pages, by name."""
    modules = {
        name: importlib.import_module(f"{__name__}.{name}")
        for name in sorted(module.name for module in pkgutil.iter_modules(__path__))
    }
    return {name: module.section for name, module in modules.items() if hasattr(module, "section")}


def page_of(part: str) -> str:
    """Name of the page that a part belongs to."""
    return str(getattr(importlib.import_module(f"{__name__}.{part}"), "PAGE", "seeds"))


def write(page: str, directory: Path) -> list[Figure]:
    """Write a page and its plots; return its figures."""
    text, figures = [HEADINGS[page]], list[Figure]()
    for name, section in parts().items():
        if page_of(name) != page:
            continue
        print(f"  {name} ...", flush=True)
        part, limits = section(directory)
        cells = [figure for figure in limits if isinstance(figure, Cell)]
        listed = [figure.row for figure in limits if not (isinstance(figure, Cell) and figure.holds)]
        within = sum(cell.holds for cell in cells)
        text.append(part + "\n".join(["", TABLE, *listed, ""]))
        if cells:
            text.append(f"Of the {len(cells)} figures of ours above, {within} are as accepted.\n")
        figures += limits
    (directory / f"{page}.md").write_text("\n".join(text))
    return figures


def main(directory: Path) -> int:
    """Write all pages and their plots; return how many figures are outside their tolerance."""
    directory.mkdir(parents=True, exist_ok=True)
    return failures([figure for page in HEADINGS for figure in write(page, directory)])
