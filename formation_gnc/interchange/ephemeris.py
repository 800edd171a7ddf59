"""Trajectories of a recorded run, as files of ephemerides hold them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from formation_gnc.analysis.recorded_parameters import epoch_of
from formation_gnc.analysis.trajectory import deputies_of
from formation_gnc.errors import BagError
from formation_gnc.flight import topics
from formation_gnc.recording.reader import Bag
from formation_gnc.types import Matrix, Vector

CHIEF = "chief"

J2000 = np.datetime64("2000-01-01T12:00:00", "ns")


@dataclass(frozen=True)
class Ephemeris:
    """True states of a satellite over a run."""

    name: str
    epoch: float
    """Terrestrial Time at time zero, s since J2000.0; zero where the bag does not say."""
    times: Vector
    """(N,) s, ascending."""
    states: Matrix
    """(N, 6) position and velocity along the inertial axes of the run (mean equator and equinox of J2000), m, m/s."""
    relative: Matrix
    """(N, 6) the same relative to the chief, Hill frame, m and m/s; zero of the chief itself."""

    def dates(self) -> NDArray[np.datetime64]:
        """(N,) Terrestrial Time, to the nanosecond."""
        since = np.rint((self.epoch + self.times) * 1e9).astype("timedelta64[ns]")
        dates: NDArray[np.datetime64] = J2000 + since
        return dates


def ephemerides(bag: Bag) -> list[Ephemeris]:
    """Chief and deputies of a run.

    Raises:
        BagError: the bag has no truth, or one that is not finite.
    """
    names = deputies_of(bag)
    truth = bag.arrays(topics.TRUTH.name, ("chief_state", "deputies"))
    columns = {CHIEF: (truth["chief_state"], np.zeros_like(truth["chief_state"]))}
    for index, name in enumerate(names):
        columns[name] = (truth[f"deputies.{index}.inertial_state"], truth[f"deputies.{index}.relative_state"])
    times, epoch = truth["time"], epoch_of(bag.metadata) or 0.0
    for name, states in columns.items():
        wrong = ~np.isfinite(np.hstack(states)).all(axis=1)
        if wrong.any():
            raise BagError(f"{bag.path}: truth of {name} at {times[wrong][0]:g} s is not finite; it must be")
    return [Ephemeris(name, epoch, times, *states) for name, states in columns.items()]
