"""What commands share that read bags: the runs in them, and what is to be said of them."""

from collections.abc import Iterable
from pathlib import Path

from formation_gnc.recording.reader import Bag


def runs_of(path: Path) -> list[Bag]:
    """Open a bag; returns its runs.

    Raises:
        BagError: it cannot be read, mixes runs, or has a topic of a run's that is of another type.
    """
    bag = Bag(path)
    bag.check_own_types()
    return bag.runs()


def numbered(path: Path, number: int, count: int) -> Path:
    """Path of what is written of one of several runs, which are numbered from 1; as it is for a single one."""
    return path if count == 1 else path.with_name(f"{path.stem}_run{number}{path.suffix}")


def print_remarks(bags: Iterable[Bag]) -> None:
    """Print what is damaged, missing, left out, doubled or out of order, each line once."""
    lines = [(bag.path, remark) for bag in bags for remark in bag.remarks]
    for line in dict.fromkeys(text if text.startswith(str(path)) else f"{path}: {text}" for path, text in lines):
        print(f"note: {line}")
