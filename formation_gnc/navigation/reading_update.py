"""Update of the filter with the readings of a tick, behind a gate on each reading."""

from collections.abc import Collection
from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np

from formation_gnc.navigation.filter_state import FilterState
from formation_gnc.navigation.kernels.linear_algebra import are_finite
from formation_gnc.navigation.measurement import Readings
from formation_gnc.navigation.measurement_checks import Rejections
from formation_gnc.navigation.pseudo_measurements import applies_to
from formation_gnc.records import Innovation, Rejection
from formation_gnc.types import Matrix, Vector


@dataclass(slots=True)
class UpdateResult:
    """Outcome of an update."""

    innovations: list[Innovation]
    """Of the readings used, beyond the gate and isolated, in the order of the readings."""
    nis: float
    used: int
    """Number of values used."""
    rejected: int
    """Number of values beyond the gate, or without a direction."""


@dataclass(slots=True)
class _Linearized:
    """Readings and the filter's prediction of them."""

    readings: Readings
    innovation: Vector
    """(m,)."""
    variance: Vector
    """(m,) predicted, of each innovation."""
    jacobian: Matrix
    """(m, 6)."""


def update(
    state: FilterState,
    readings: Readings,
    gate: float,
    pseudo: bool,
    rejections: Rejections,
    isolated: Collection[str] = (),
) -> UpdateResult:
    """Update the filter with the readings within the gate, but for those of isolated sensors.

    Args:
        state: of the filter, updated.
        readings: checked ones.
        gate: largest accepted innovation squared over its variance.
        pseudo: whether to use pseudo-measurements when there is a fresh reading of each of their sensors.
        rejections: counts, added to.
        isolated: sensors whose readings are compared with the state, and not used.

    Raises:
        ArithmeticError: the result is not finite.
    """
    within, innovations = _gated(state, readings, gate, rejections, isolated)
    offered, model = readings.model.size, readings.model
    if isolated:
        offered -= sum(
            rows.stop - rows.start for name, rows in zip(model.sensors, model.rows, strict=True) if name in isolated
        )
    if within is None:
        return UpdateResult(innovations, 0.0, 0, offered)
    readings = within.readings
    state.observability.add(within.jacobian, readings.variance)
    nis = state.filter.update(pseudo and not readings.late and applies_to(readings.model))
    if not (are_finite(state.filter.state, state.filter.covariance) and isfinite(nis)):
        raise ArithmeticError("the update is not finite")
    state.noise.add(readings, within.innovation, within.variance, within.jacobian, state.filter.covariance)
    state.last_reading = state.time
    final = iter(_innovations(within, gate))
    innovations = [each if each.rejection else next(final) for each in innovations] or list(final)
    used = readings.model.size
    return UpdateResult(innovations, nis, used, offered - used)


@np.errstate(all="ignore")  # a reading may be as large as a float
def _gated(
    state: FilterState, readings: Readings, gate: float, rejections: Rejections, isolated: Collection[str]
) -> tuple[_Linearized | None, list[Innovation]]:
    """The readings to be used, linearised, and the innovations of all readings if some are not."""
    offered = _Linearized(readings, *state.filter.linearize(readings))
    values = zip(offered.innovation.tolist(), offered.variance.tolist(), strict=True)
    within = [value * value <= gate * variance for value, variance in values]  # false for NaN
    if not isolated and all(within):
        return offered, []
    names = readings.model.sensors
    passed = [all(within[rows]) and name not in isolated for name, rows in zip(names, readings.model.rows, strict=True)]
    if all(passed):
        return offered, []
    ratios = np.abs(offered.innovation) / np.sqrt(offered.variance)
    innovations = []
    for innovation, rows, passes in zip(_innovations(offered, gate), readings.model.rows, passed, strict=True):
        ratio = float(ratios[rows].max())  # NaN if one is
        if not passes and not isfinite(ratio):
            rejections.add(Rejection.NO_DIRECTION, innovation.sensor)
            continue
        if innovation.sensor in isolated:
            innovation.rejection = Rejection.ISOLATED
        elif not passes:
            rejections.add(Rejection.GATE, innovation.sensor, f"{ratio:.1f} standard deviations off")
            innovation.rejection = Rejection.GATE
            noise, total = readings.variance[rows].tolist(), offered.variance[rows].tolist()
            state.noise.reject(innovation.sensor, innovation.values, noise, total)
        innovations.append(innovation)
    if not any(passed):
        return None, innovations
    readings = readings.select(passed)
    return _Linearized(readings, *state.filter.linearize(readings)), innovations


def _innovations(linearized: _Linearized, gate: float) -> list[Innovation]:
    model, largest = linearized.readings.model, sqrt(gate)
    values, sigmas = linearized.innovation.tolist(), np.sqrt(linearized.variance).tolist()
    ratios = [abs(value) / (largest * sigma) for value, sigma in zip(values, sigmas, strict=True)]
    return [
        Innovation(name, values[rows], sigmas[rows], max(ratios[rows]), "")
        for name, rows in zip(model.sensors, model.rows, strict=True)
    ]
