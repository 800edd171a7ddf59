"""Target paths: formations propagated by relative-motion models."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.formation import Formation
from formation_gnc.orbit.elements import (
    Elements,
    elements_from_state,
    mean_from_true_anomaly,
    state_from_elements,
    true_from_mean_anomaly,
)
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.mean import mean_elements, secular_rates
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HarmonicModel, HillModel
from formation_gnc.relative.model import LinearModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel
from formation_gnc.types import Matrix, Vector

CHECKS = 24
"""Intervals of a revolution between the points at which the error of a path is computed."""


class TargetPath(ABC):
    """Target of a deputy at any time of the run: a formation from a phase at time zero, propagated by one model.

    The phase refers to time zero of the run, not to the time of a change. So deputies that change formation,
    size or slot at different times are in formation again.
    """

    def __init__(self, formation: Formation[Any], phase: float, common: CommonParameters) -> None:
        """Propagate `formation`, prepared for the mean motion of `common`, from `phase` (rad) at time zero."""
        self._formation, self._phase, self._common = formation, phase, common
        self._ahead = phase / common.mean_motion

    @abstractmethod
    def states(self, times: Vector) -> Matrix:
        """(N, 6) target states, Hill frame, m and m/s, at times (N,) in s since the start of the run."""

    def coast(self, states: Matrix, time: float, ahead: Vector) -> Matrix:
        """(K, N, 6) states of free motion in the model from states (N, 6) at a time (s), after times (K,) s."""
        moved: Matrix = (self._transitions(time, ahead) @ states.T).swapaxes(1, 2)
        return moved

    @abstractmethod
    def _transitions(self, time: float, ahead: Vector) -> Matrix:
        """(K, 6, 6) transition matrices from a time (s) to times (K,) s after it."""

    def error(self) -> tuple[float, float]:
        """Largest error and largest distance of the path over the first revolution, m.

        The error is against two-body motion of chief and deputy in closed form, with the deputy starting on the
        path. It covers linearisation, and an eccentricity that the model neglects.

        Raises:
            ConfigurationError: the path starts on no orbit about the Earth.
        """
        chief = Elements(**vars(self._common.chief))
        inertial = state_from_elements(chief)
        times = np.linspace(0.0, math.tau / self._common.mean_motion, CHECKS + 1)
        path = self.states(times)
        try:
            deputy = elements_from_state(inertial_from_relative(inertial, path[0]))
        except ConfigurationError as reason:
            raise ConfigurationError(f"this formation starts on no orbit about the Earth: {reason}") from None
        exact = np.array(
            [relative_from_inertial(_advanced(chief, float(t)), _advanced(deputy, float(t))) for t in times]
        )
        errors = np.linalg.norm(exact[:, :3] - path[:, :3], axis=1)
        return float(errors.max()), float(np.linalg.norm(path[:, :3], axis=1).max())


def _advanced(orbit: Elements, time: float) -> Vector:
    """Inertial state (6,) on a Kepler orbit after a time, s."""
    e = orbit.eccentricity
    anomaly = mean_from_true_anomaly(orbit.true_anomaly, e) + orbit.mean_motion * time
    return state_from_elements(
        Elements(
            orbit.semi_major_axis,
            e,
            orbit.inclination,
            orbit.right_ascension,
            orbit.argument_of_perigee,
            true_from_mean_anomaly(anomaly, e),
        )
    )


class HillPath(TargetPath):
    """The formation itself, by the closed form of Hill's equations, as about a circular orbit."""

    def states(self, times: Vector) -> Matrix:
        """(N, 6) states of the formation."""
        return self._formation.states(np.asarray(times) + self._ahead)

    def _transitions(self, time: float, ahead: Vector) -> Matrix:
        transitions: Matrix = HillModel(self._common.mean_motion).transition(0.0, ahead)
        return transitions


class _StartedPath(TargetPath):
    """Free motion in another model, from a start that looks like the formation's.

    The start has the formation's position, its radial and cross-track rates in proportion to the model's own
    frequencies there, and the along-track rate that does not drift in the model, plus the formation's own
    drift.
    """

    def _start(self, model: LinearModel, in_plane: float, across: float) -> Vector:
        n = self._common.mean_motion
        given = self._formation.states(np.array([self._ahead]))[0]
        start = given * np.array([1.0, 1.0, 1.0, in_plane / n, 1.0, across / n])
        bounded: Vector = model.bounded(0.0, start)
        bounded[4] += given[4] + 2.0 * n * given[0]
        return bounded


class YamanakaAnkersenPath(_StartedPath):
    """Periodic motion about a chief of any eccentricity (Yamanaka and Ankersen).

    In the true anomaly f the radial motion keeps the formation's shape exactly, x = c1 sin f + c2 cos f;
    along the track and across it the path is drawn out with the chief's distance.
    """

    def __init__(self, formation: Formation[Any], phase: float, common: CommonParameters) -> None:
        """Start at the chief's anomaly at time zero."""
        super().__init__(formation, phase, common)
        chief = KeplerChief.of(Elements(**vars(common.chief)))
        rate = chief.at(0.0).angular_rate
        self._model = TschaunerHempelModel(chief)
        self._state = self._start(self._model, rate, rate)

    def states(self, times: Vector) -> Matrix:
        """(N, 6) states, a transition matrix each."""
        return self._transitions(0.0, times) @ self._state

    def _transitions(self, time: float, ahead: Vector) -> Matrix:
        return np.array([self._model.transition(time, time + float(later)) for later in ahead])


@dataclass(frozen=True)
class J2MeanMotionModel(HarmonicModel):
    """Hill's equations at the rates that J2 gives a near-circular chief on average.

    The Hill frame turns, and the nodes come round, at the rate of the mean argument of latitude; the ellipse
    of the relative motion comes round at that of the mean anomaly, since the chief's perigee turns. Mean
    elements: the osculating semi-major axis would give the mean motion to a part in a thousand only.
    """

    latitude_rate: float
    anomaly_rate: float

    @classmethod
    @cache  # slot assignment makes hundreds of paths about one chief
    def of(cls, osculating: Elements) -> "J2MeanMotionModel":
        """The rates of a chief with these osculating elements."""
        _, perigee, anomaly = secular_rates(mean_elements(osculating))
        return cls(perigee + anomaly, anomaly)

    @property
    def frequencies(self) -> tuple[float, float, float]:
        """Frame's rate, in-plane and cross-track frequency, rad/s."""
        return self.latitude_rate, self.anomaly_rate, self.latitude_rate


class J2MeanMotionPath(_StartedPath):
    """Free motion at the mean rates under J2: the phase keeps up with the truth, the shape shears with it."""

    def __init__(self, formation: Formation[Any], phase: float, common: CommonParameters) -> None:
        """Start at the phase at time zero."""
        super().__init__(formation, phase, common)
        self._model = J2MeanMotionModel.of(Elements(**vars(common.chief)))
        _, in_plane, across = self._model.frequencies
        self._state = self._start(self._model, in_plane, across)

    def states(self, times: Vector) -> Matrix:
        """(N, 6) states in closed form."""
        return self._transitions(0.0, times) @ self._state

    def _transitions(self, time: float, ahead: Vector) -> Matrix:
        transitions: Matrix = self._model.transition(0.0, ahead)
        return transitions

    def error(self) -> tuple[float, float]:
        """As Hill's: about a point mass, the rates that J2 gives would count as an error."""
        return HillPath(self._formation, self._phase, self._common).error()


TARGET_MODELS: dict[str, type[TargetPath]] = {
    "hill": HillPath,
    "yamanaka_ankersen": YamanakaAnkersenPath,
    "j2_mean_motion": J2MeanMotionPath,
}
"""The models that a target can move by, by name."""
