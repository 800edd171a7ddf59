"""The truth and its files beside Orekit and Basilisk: like models after one day and after ten.

`main` writes `accuracy.md` and returns the number of figures outside their tolerance.
"""

import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from formation_gnc.cli import main as command
from formation_gnc.orbit.elements import state_from_elements
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.recording import Bag
from verification import orekit
from verification.dynamics import BODY, DAY, EPOCH, ORBITS, apart, fly, number
from verification.figure import TABLE, Figure, failures
from verification.independent import Basilisk, series

GRAVITY = {"central": Forces(zonal_degree=0), "J2": Forces(zonal_degree=2), "J2 to J6": Forces(zonal_degree=6)}

TICK = 10.0
"""Of our flights, s."""

DAYS = {1: 1e-3, 10: 1e-2}
"""Durations, days, and tolerances, m: a tenth of the required 1 cm after a day. Rounding grows along the track with the
square of the time; most of it is Orekit's, as the difference between the other two says."""


def gravity() -> tuple[str, list[Figure]]:
    """Every orbit under central attraction and zonal harmonics, by three programs."""
    figures, rows = [], []
    for name, forces in GRAVITY.items():
        for place, orbit in ORBITS.items():
            start = state_from_elements(orbit)
            for days, limit in DAYS.items():
                ours = fly(orbit, forces, TICK, days * DAY)
                beside = {
                    "Orekit": orekit.fly(start, days * DAY, forces),
                    "Basilisk": Basilisk(forces, EPOCH, start[None], TICK, BODY, series).fly(days * DAY)[0],
                }
                differences = {program: apart(ours, theirs) for program, theirs in beside.items()}
                between = apart(*beside.values())
                rows.append(
                    f"| {name} | {place} | {days} | {' | '.join(map(number, (*differences.values(), between)))} |"
                )
                figures += [
                    Figure(f"{name}, {place}, {days} d, {program}", "", difference, "m", 0.0, limit)
                    for program, difference in differences.items()
                ]
    head = "| gravity | orbit | days | from Orekit, m | from Basilisk, m | between these, m |\n" + "|---" * 6 + "|"
    text = (
        "## Gravity\n\nThe same start, constants and force. Orekit integrates by Dormand and Prince's method of order "
        f"8, with a relative tolerance of {orekit.RELATIVE:g}; Basilisk by Runge, Kutta and Fehlberg's of order 7, in "
        f"steps of {TICK:g} s at most; ours flies in ticks of {TICK:g} s.\n\n" + "\n".join([head, *rows]) + "\n\n"
        "Where ours is further from Orekit than from Basilisk, so is Basilisk: that part is Orekit's own.\n\n"
        "Sun, Moon, sunlight, drag and EGM2008 beside Basilisk are on the page of [dynamics](dynamics.md). Not beside "
        "Orekit: these need its data files (ephemerides, orientation of the Earth), which are not on a package "
        "registry. Not beside GMAT: it is not on one either.\n"
    )
    return text, figures


def files() -> tuple[str, list[Figure]]:
    """An OEM of a flight as Orekit reads it, beside the truth in the bag."""
    with TemporaryDirectory() as directory, redirect_stdout(StringIO()):
        bag = Path(directory, "flight")
        flight = ["sil", "leader_follower", "--in-process", "--duration", "7200", "--bag", str(bag)]
        exported = ["export", str(bag), "--format", "oem"]
        for words in (flight, exported):
            if command(words):
                raise RuntimeError(f"formation-gnc {' '.join(words)} failed")
        truth = Bag(bag).arrays("/truth")
        segments = [each for path in sorted(Path(directory).rglob("*.oem")) for each in orekit.read_oem(path)]
        read = {name: states for name, _, states in segments}
    places = {"CHIEF": truth["chief_state"], "DEPUTY1": truth["deputies.0.inertial_state"]}
    figures = [
        Figure(
            f"{name.lower()}: largest difference of {len(states)} positions",
            "below 1 mm",
            float(np.linalg.norm((states - places[name])[:, :3], axis=1).max()),
            "m",
            0.0,
            1e-3,
        )
        for name, states in read.items()
    ]
    text = (
        "## Files\n\nTwo hours of `leader_follower`, exported by `formation-gnc export --format oem` and read by the "
        "parser of Orekit, beside the truth in the bag.\n"
    )
    return text, figures


def main(directory: Path) -> int:
    """Write the page; return how many figures are outside their tolerance."""
    directory.mkdir(parents=True, exist_ok=True)
    parts = [gravity(), files()]
    figures = [figure for _, own in parts for figure in own]
    heading = "# Accuracy\n\nWritten by `verification/accuracy.py`: what this project flies beside what others do.\n"
    verdicts = "## Stated tolerances\n\n" + "\n".join([TABLE, *(figure.row for figure in figures)]) + "\n"
    (directory / "accuracy.md").write_text("\n".join([heading, *(text for text, _ in parts), verdicts]))
    return failures(figures)


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/verification")) else 0)
