"""Target paths: formations propagated by relative-motion models."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, Self

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.errors import OrbitError
from formation_gnc.guidance.curvilinear import curvilinear_from_hill, hill_from_curvilinear
from formation_gnc.guidance.formation import Formation
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import (
    Elements,
    elements_from_state,
    mean_from_true_anomaly,
    state_from_elements,
    true_from_mean_anomaly,
)
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.mean import advanced, mean_elements, mean_state, osculating_state
from formation_gnc.relative.elements_model import RelativeElementsModel
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import LinearModel
from formation_gnc.relative.registry import MODELS
from formation_gnc.relative.relative_elements import deputy_elements, drifted, mean_relative_elements, with_drift
from formation_gnc.types import Matrix, Vector

CHECKS = 24
"""Intervals of a revolution between the points at which the error of a path is computed."""


class TargetPath(ABC):
    """Target of a deputy at any time of the run: a formation from a phase at time zero, propagated by one model.

    The phase refers to time zero of the run, not to the time of a change. So deputies that change formation,
    size or slot at different times are in formation again. Formations and models are in curvilinear coordinates,
    targets in the Cartesian Hill frame.
    """

    def __init__(self, formation: Formation[Any], phase: float, common: CommonParameters) -> None:
        """Propagate `formation`, prepared for the mean motion of `common`, from `phase` (rad) at time zero."""
        self._chief, self._chief_time = state_from_elements(common.chief_elements), 0.0
        self._given, self._phase, self._common = formation, phase, common
        self._formation = formation.about(self._chief)
        self._ahead = phase / common.mean_motion

    def anchored(self, chief: Vector, time: float) -> Self:
        """The path about the orbit that the chief's inertial state (6,) at a time (s) is on; the same without one."""
        if not _is_on_ellipse(chief):
            return self
        path = object.__new__(type(self))  # several times faster than copy
        path.__dict__.update(self.__dict__, _chief=chief, _chief_time=time)
        return path

    def states_ahead(self, chief: Vector, time: float, ahead: Vector) -> Matrix:
        """(N, 6) states at times (N,) s after a time (s), as `anchored` to the chief's inertial state (6,) then."""
        times = time + ahead
        if not _is_on_ellipse(chief):
            return self.states(times)
        return hill_from_curvilinear(self.curvilinear(times), chief, times - time, MU)

    def states(self, times: Vector) -> Matrix:
        """(N, 6) target states, Hill frame, m and m/s, at times (N,) in s since the start of the run."""
        return hill_from_curvilinear(self.curvilinear(times), self._chief, times - self._chief_time, MU)

    @abstractmethod
    def curvilinear(self, times: Vector) -> Matrix:
        """As `states`, in curvilinear coordinates."""

    def coast(self, states: Matrix, time: float, ahead: Vector) -> Matrix:
        """(K, N, 6) states of free motion in the model from states (N, 6) at a time (s), after times (K,) s."""
        now = time - self._chief_time
        start = curvilinear_from_hill(states, self._chief, np.full(len(states), now), MU)
        moved = (self._transitions(time, ahead) @ start.T).swapaxes(1, 2)
        later = np.repeat(now + ahead, len(states))
        return hill_from_curvilinear(moved.reshape(-1, 6), self._chief, later, MU).reshape(moved.shape)

    @abstractmethod
    def _transitions(self, time: float, ahead: Vector) -> Matrix:
        """(K, 6, 6) transition matrices from a time (s) to times (K,) s after it."""

    def error(self) -> tuple[float, float]:
        """Largest error and largest distance of the path over the first revolution, m.

        The error is against two-body motion of chief and deputy in closed form, with the deputy starting on the
        path. It covers linearisation, and an eccentricity that the model neglects.

        Raises:
            OrbitError: the path starts on no orbit about the Earth.
        """
        chief = self._common.chief_elements
        inertial = state_from_elements(chief)
        times = np.linspace(0.0, math.tau / self._common.mean_motion, CHECKS + 1)
        path = self.states(times)
        try:
            deputy = elements_from_state(inertial_from_relative(inertial, path[0]))
        except OrbitError as reason:
            raise OrbitError(f"this formation starts on no orbit about the Earth: {reason}") from None
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


def _is_on_ellipse(chief: Vector) -> bool:
    x, y, z, vx, vy, vz = chief.tolist()
    radius, square = math.sqrt(x * x + y * y + z * z), vx * vx + vy * vy + vz * vz
    return bool(0.0 < radius * square < 2.0 * MU)  # false for what is not finite


class HillPath(TargetPath):
    """The formation's own states, which are solutions of Hill's equations about a circular orbit."""

    def curvilinear(self, times: Vector) -> Matrix:
        """(N, 6) states of the formation."""
        return self._formation.states(times + self._ahead)

    def _transitions(self, time: float, ahead: Vector) -> Matrix:
        transitions: Matrix = HillModel(self._common.mean_motion).transition(0.0, ahead)
        return transitions


class ModelPath(TargetPath):
    """Free motion in a linear model, from a start that resembles the formation's.

    The start has the formation's position, its radial and cross-track rates in proportion to the model's own
    rates there, and the along-track rate that does not drift in the model, plus the formation's own drift.
    About an eccentric chief (Yamanaka and Ankersen) the radial motion then keeps the formation's shape in the
    true anomaly f, x = c1 sin f + c2 cos f; along and across the track the path is stretched with the chief's
    distance. At the mean rates under J2 the phase follows the truth; about an eccentric chief the path is anchored
    to the estimated one, whose period and perigee J2 changes: its constants stay, by the true anomaly.
    """

    def __init__(
        self, model: type[LinearModel], formation: Formation[Any], phase: float, common: CommonParameters
    ) -> None:
        """Start at time zero; raises OrbitError where the model does not exist about the chief."""
        super().__init__(formation, phase, common)
        self.model = model.about(common.chief_elements)
        self._start = self._start_in(self.model)
        self._reference: tuple[LinearModel, Vector] | None = None
        """The model anchored to the chief at time zero, and the start in it."""

    def _start_in(self, model: LinearModel) -> Vector:
        """(6,) state at time zero in a model."""
        n, (in_plane, across) = self._common.mean_motion, model.phase_rates(0.0)
        given: Vector = self._formation.states(np.array([self._ahead]))[0]
        drift = given[4] + 2.0 * n * given[0]
        if self._formation.is_given and abs(given[4] - model.bounded(0.0, given)[4]) < abs(drift):
            return given
        start: Vector = model.bounded(0.0, given * np.array([1.0, 1.0, 1.0, in_plane / n, 1.0, across / n]))
        start[4] += drift
        return start

    def curvilinear(self, times: Vector) -> Matrix:
        """(N, 6) states by the model's transition matrices."""
        return self._transitions(0.0, times) @ self._start

    def states_ahead(self, chief: Vector, time: float, ahead: Vector) -> Matrix:
        """With the same constants of motion about the orbit that the chief is seen on."""
        return self.anchored(chief, time).states(time + ahead)

    def anchored(self, chief: Vector, time: float) -> Self:
        """With the same constants of motion about the orbit that the chief is seen on."""
        path, model = super().anchored(chief, time), self.model.anchored(chief, time)
        if path is self or model is self.model:
            return path  # a model without a perigee, or a chief without an orbit
        if self._reference is None:
            first = self.model.anchored(state_from_elements(self._common.chief_elements), 0.0)
            self._reference = first, self._start_in(first)
        path.model, path._start = model, model.continued(self._reference[1], self._reference[0])
        return path

    def _transitions(self, time: float, ahead: Vector) -> Matrix:
        return self.model.transitions(time, ahead)

    def error(self) -> tuple[float, float]:
        """As `TargetPath.error`; of Hill's path where the model has J2, which the reference has not."""
        if self.model.has_j2:
            return HillPath(self._given, self._phase, self._common).error()
        return super().error()


class ElementsPath(ModelPath):
    """Free motion under J2 by mean relative elements, at any separation and eccentricity.

    The mean elements of chief and deputy drift at their secular rates; the target is the deputy that has the relative
    elements of the time about the chief as it is seen, short-period perturbations of both included. Formations that
    are not given by elements start as in `ModelPath`, without the drift that the linear model leaves.
    """

    def __init__(
        self, model: type[LinearModel], formation: Formation[Any], phase: float, common: CommonParameters
    ) -> None:
        """Start at time zero; raises OrbitError for a chief without a node, or a deputy off any orbit."""
        super().__init__(model, formation, phase, common)
        self._first = mean_elements(common.chief_elements)
        elements = self._formation.elements(phase)
        if elements is None:
            start = hill_from_curvilinear(self._start[None], self._chief, np.zeros(1), MU)[0]
            elements = mean_relative_elements(self._chief, start)
            if not self._formation.is_given:
                elements = with_drift(self._first, elements, self._drift())
        self._elements = elements
        self._mean = self._first
        """Mean elements of the chief at its time."""
        deputy_elements(self._first, elements)

    def _drift(self) -> float:
        """Rate (m/s) at which the formation drifts along the track under Hill's equations."""
        given = self._formation.states(np.array([self._ahead]))[0]
        return -3.0 * float(given[4] + 2.0 * self._common.mean_motion * given[0])

    def anchored(self, chief: Vector, time: float) -> Self:
        """With the same relative elements about the mean orbit that the chief is seen on; the same without one."""
        if not _is_on_ellipse(chief):
            return self
        try:
            mean = elements_from_state(mean_state(chief))
            deputy_elements(mean, drifted(self._first, self._elements, time))
        except OrbitError:
            return self
        path = super(ModelPath, self).anchored(chief, time)
        path._mean = mean
        return path

    def states(self, times: Vector) -> Matrix:
        """(N, 6) target states, Hill frame, m and m/s."""
        times = np.asarray(times, dtype=np.float64)
        chiefs = [advanced(self._mean, time) for time in (times - self._chief_time).tolist()]
        return _states_about(chiefs, [drifted(self._first, self._elements, time) for time in times.tolist()])

    def coast(self, states: Matrix, time: float, ahead: Vector) -> Matrix:
        """As `TargetPath.coast`, by the mean elements of each state; linear where one is on no orbit."""
        chief = advanced(self._mean, time - self._chief_time)
        inertial = osculating_state(state_from_elements(chief))
        try:
            given = [mean_relative_elements(inertial, state) for state in states]
            moved = [drifted(chief, each, later) for later in ahead.tolist() for each in given]
            chiefs = [advanced(chief, later) for later in ahead.tolist() for _ in given]
            return _states_about(chiefs, moved).reshape(len(ahead), len(states), 6)
        except OrbitError:
            return super().coast(states, time, ahead)

    def curvilinear(self, times: Vector) -> Matrix:
        """As `states`, in curvilinear coordinates."""
        return curvilinear_from_hill(self.states(times), self._chief, times - self._chief_time, MU)

    def _transitions(self, time: float, ahead: Vector) -> Matrix:
        return self.model.anchored(self._chief, self._chief_time).transitions(time, ahead)

    def error(self) -> tuple[float, float]:
        """No error worth a report, and the largest distance over the first revolution, m."""
        path = self.states(np.linspace(0.0, math.tau / self._common.mean_motion, CHECKS + 1))
        return 0.0, float(np.linalg.norm(path[:, :3], axis=1).max())


def _states_about(chiefs: list[Elements], relative: list[Vector]) -> Matrix:
    """(N, 6) relative states, Hill frame, of deputies with mean relative elements about chiefs with mean elements."""
    orbits = [*chiefs, *map(deputy_elements, chiefs, relative)]
    inertial = osculating_state(np.array([state_from_elements(each) for each in orbits]).reshape(-1, 6))
    pairs = zip(inertial[: len(chiefs)], inertial[len(chiefs) :], strict=True)
    return np.array([relative_from_inertial(chief, deputy) for chief, deputy in pairs]).reshape(-1, 6)


def _path(model: type[LinearModel]) -> Callable[[Formation[Any], float, CommonParameters], TargetPath]:
    if model is HillModel:
        return HillPath
    return partial(ElementsPath if model is RelativeElementsModel else ModelPath, model)


TARGET_MODELS = {
    name: _path(model) for name, model in MODELS.items() if issubclass(model, LinearModel) and model.has_closed_form
}
"""The models of the registry that a target can move by, by name: linear and in closed form."""
