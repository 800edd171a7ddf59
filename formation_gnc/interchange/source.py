"""Orbits of satellites from files of others."""

from abc import ABC, abstractmethod

import numpy as np

from formation_gnc.interchange.times import instant
from formation_gnc.types import Vector

METRES = 1e3
"""In a kilometre."""

FRAMES = {"EME2000": "EME2000", "J2000": "EME2000", "GCRF": "GCRF", "ICRF": "GCRF", "TEME": "TEME", "ITRF": "ITRF"}
"""Frames of states, by the names that files give them; numbered ITRF, as ITRF2020, count as ITRF."""


class OrbitSource(ABC):
    """A satellite's orbit as a file gives it.

    Attributes:
        name: of the satellite.
        first, last: times between which it has states, s of TT since J2000.0.
        reference: time at which it is best known, likewise.
    """

    name: str
    first: float
    last: float
    reference: float

    @abstractmethod
    def state(self, time: float) -> Vector:
        """(6,) position and velocity about the Earth, mean equator and equinox of J2000, m and m/s.

        Args:
            time: s of TT since J2000.0.

        Raises:
            OrbitError: no state is known at that time.
        """


def to_j2000(state: Vector, frame: str, time: float) -> Vector:
    """(6,) state along the axes of J2000 of one in another frame, m and m/s.

    Precession, nutation and the Earth's rotation are Skyfield's, without polar motion and with its table of UT1.

    Args:
        state: (6,) in the frame.
        frame: of `FRAMES`.
        time: s of TT since J2000.0.
    """
    if frame == "EME2000":
        return state
    from skyfield.framelib import ICRS_to_J2000, itrs
    from skyfield.positionlib import ICRF
    from skyfield.sgp4lib import TEME
    from skyfield.units import Distance, Velocity

    moving = {"TEME": TEME, "ITRF": itrs}.get(frame)
    if moving is not None:
        there = Distance(m=state[:3]), Velocity(km_per_s=state[3:] / METRES)
        seen = ICRF.from_time_and_frame_vectors(instant(time), moving, *there)
        state = np.concatenate((seen.position.m, seen.velocity.km_per_s * METRES))
    turn = np.array(ICRS_to_J2000)
    return np.concatenate((turn @ state[:3], turn @ state[3:]))
