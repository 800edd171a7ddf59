"""A scenario's start from files of orbits: the first satellite is the chief, the others are its deputies."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np

from formation_gnc.common import FIRST_EPOCH, LAST_EPOCH
from formation_gnc.errors import ConfigurationError, OrbitError
from formation_gnc.interchange.oem import read_oem
from formation_gnc.interchange.source import OrbitSource
from formation_gnc.interchange.tle import read_tle
from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.orbit.frames import relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.plain_file import check_plain
from formation_gnc.types import Vector

LARGEST_FILE = 100_000_000
"""Bytes of a file of orbits at most."""

STEP = 10.0
"""Integration step, s: the plant's own by default."""

LOOKS = 24
"""Times of a run at which the source is compared with the truth's own propagation."""


@dataclass(frozen=True)
class Start:
    """Satellites at an instant."""

    names: Sequence[str]
    """Of chief and deputies, in their files."""
    epoch: float
    """s of TT since J2000.0."""
    chief: Elements
    """Osculating."""
    relative: Sequence[Vector]
    """(6,) state of each deputy relative to the chief, Hill frame, m and m/s."""


def read_orbits(paths: Sequence[Path]) -> list[OrbitSource]:
    """Every satellite of files of TLE or OEM, by what they hold.

    Raises:
        OrbitError: a file that holds neither, or cannot be read as what it holds.
        ConfigurationError: a file that is too large or is no text.
    """
    found: list[OrbitSource] = []
    for path in paths:
        check_plain(path)
        if path.stat().st_size > LARGEST_FILE:
            raise ConfigurationError(f"{path}: has {path.stat().st_size} bytes; at most {LARGEST_FILE} are allowed")
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            raise ConfigurationError(f"{path}: is no text; it must be a TLE, an OEM or a scenario") from None
        found += read_oem(path, text) if "CCSDS_OEM_VERS" in text else read_tle(path, text)
    return found


def start_of(orbits: Sequence[OrbitSource], epoch: float | None) -> Start:
    """Chief and deputies at an epoch.

    Args:
        orbits: of the chief and of each deputy.
        epoch: s of TT since J2000.0; None for the latest at which one of them is best known.

    Raises:
        OrbitError: a satellite without a state at the epoch, or a chief on no closed orbit.
    """
    if epoch is None:
        epoch = max(orbit.reference for orbit in orbits)
    if not FIRST_EPOCH <= epoch <= LAST_EPOCH:
        raise OrbitError(f"epoch {epoch:g} s since J2000.0: must lie between the years 1950 and 2050")
    chief, *deputies = (orbit.state(epoch) for orbit in orbits)
    return Start(
        [orbit.name for orbit in orbits],
        epoch,
        elements_from_state(chief),
        [relative_from_inertial(chief, deputy) for deputy in deputies],
    )


def departure(orbits: Sequence[OrbitSource], epoch: float, duration: float) -> tuple[float, float]:
    """Largest distance (m) of coasting under J2 alone from the source over a run, and of one satellite to another.

    The second is that of the positions relative to the chief; zero without a deputy. Times that a source does not
    reach are left out.
    """
    states = np.array([orbit.state(epoch) for orbit in orbits])
    step = duration / LOOKS
    propagator = Propagator(step, ceil(step / STEP))
    alone = between = 0.0
    for look in range(LOOKS):
        states = propagator.propagate(look * step, states, np.zeros((len(orbits), 3)))
        time = epoch + (look + 1) * step
        if any(time > orbit.last for orbit in orbits):
            break
        off = states[:, :3] - np.array([orbit.state(time)[:3] for orbit in orbits])
        alone = max(alone, float(np.linalg.norm(off, axis=1).max()))
        between = max(between, float(np.linalg.norm(off - off[0], axis=1).max()))
    return alone, between
