"""Formation given by relative orbital elements."""

import math
from dataclasses import astuple, dataclass

import numpy as np

from formation_gnc.guidance.formation import Formation
from formation_gnc.parameters import parameter
from formation_gnc.relative.chief import latitude_of
from formation_gnc.relative.relative_elements import near_circular_matrix
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class RelativeElementsParameters:
    """Mean relative elements at the start of the run, times the chief's semi-major axis."""

    da: float = parameter(
        0.0, unit="m", in_flight=True, doc="difference of semi-major axes, which makes the formation drift along-track"
    )
    dlambda: float = parameter(0.0, unit="m", in_flight=True, doc="difference of mean longitudes: along-track offset")
    dex: float = parameter(0.0, unit="m", in_flight=True, doc="relative eccentricity vector, towards the node")
    dey: float = parameter(300.0, unit="m", in_flight=True, doc="relative eccentricity vector, a quarter turn on")
    dix: float = parameter(0.0, unit="m", in_flight=True, doc="relative inclination vector: difference of inclinations")
    diy: float = parameter(
        400.0, unit="m", in_flight=True, doc="relative inclination vector: difference of nodes times sin i"
    )


class RelativeElements(Formation[RelativeElementsParameters]):
    """An ellipse about the chief in quasi-nonsingular relative elements, slot k with k + 1 times those given.

    With parallel relative eccentricity and inclination vectors (the default) satellites and chief keep the smaller
    of both from each other across the flight direction at every point of the orbit, whatever the along-track error:
    passive safety (D'Amico and Montenbruck 2006). Force-free under Hill's equations. In the target model
    `relative_elements` the elements are mean ones and drift as J2 has it.
    """

    Parameters = RelativeElementsParameters

    def __init__(self, parameters: RelativeElementsParameters, mean_motion: float, slot: int = 0) -> None:
        """Any elements are allowed."""
        self._elements: Vector = (slot + 1) * np.array(astuple(parameters))
        self._rate, self._latitude = mean_motion, 0.0

    @staticmethod
    def slot_count(parameters: RelativeElementsParameters) -> None:
        """Unlimited."""

    def about(self, chief: Vector) -> "RelativeElements":
        """With the argument of latitude that an inertial state (6,) of the chief has at time zero."""
        formation = object.__new__(RelativeElements)
        formation.__dict__.update(self.__dict__, _latitude=latitude_of(chief) or 0.0)
        return formation

    def elements(self, phase: float) -> Vector:
        """(6,) the elements at time zero, their vectors turned back by the phase (rad)."""
        elements, sine, cosine = self._elements.copy(), math.sin(phase), math.cos(phase)
        elements[1] -= 1.5 * phase * elements[0]
        back = np.array([[cosine, sine], [-sine, cosine]])
        elements[2:4], elements[4:] = back @ elements[2:4], back @ elements[4:]
        return elements

    def states(self, times: Vector) -> Matrix:
        """(N, 6) states about a near-circular chief."""
        angles = self._rate * np.asarray(times)
        states: Matrix = near_circular_matrix(self._latitude + angles, self._rate) @ self._elements
        drift = 1.5 * self._elements[0] * angles
        states[:, 1] -= drift
        return states
