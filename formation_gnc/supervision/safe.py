"""The way out: what a satellite flies in modes in which no law does, and why."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import tau
from typing import Protocol

import numpy as np

from formation_gnc.errors import ConfigurationError, ImpactError
from formation_gnc.mode_records import NO_FORCE, Mode
from formation_gnc.records import Estimate
from formation_gnc.supervision.coasting import Burn, Forecast, Outcome
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.passive_safety import elements, manoeuvre, safe_orbits
from formation_gnc.types import AXES, NANOSECONDS, Matrix, Vector

RISK = 1e-3
"""Probability of coming closer than the limit, up to which coasting is safe."""

HORIZON, SOON = 86400.0, 2.0
"""Time for which `safe` is to be safe without thrust, s, and revolutions for which `avoid` is to be."""

CLEARANCES = (1.0, 1.5, 2.0, 3.0)
"""Clearances across the track that are tried, over the limit with its uncertainty."""

SIGMAS = 3.1
"""Standard deviations of the clearance beyond the limit: a chance of `RISK`."""

PUSHES = (1, 2, 4, 8, 16)
"""Lengths, in steps of the forecast, of burns along one axis from now on."""

CERTAIN = 3.0
"""Standard deviations by which the side of every other satellite has to be known for a retreat."""

DISTRUST = 3.0
"""Factor on the deviations of a state that is not trusted."""

_CHIEF = np.zeros((1, 6))

type Factors = tuple[float, float, float]
"""By axis."""


@dataclass(frozen=True)
class Situation:
    """What a decision is made on."""

    chief: Vector
    """Inertial state (6,), m and m/s."""
    relative: Vector
    """State (6,) of the satellite, Hill frame."""
    covariance: Matrix
    """Of it, (6, 6)."""
    others: Matrix
    """Relative states (N, 6) of the other satellites; that of the chief is zero."""
    limit: float
    """Least distance to any of them, m."""
    acceleration: Vector
    """Largest one (3,) on each Hill axis, m/s^2; 0 for an axis that does not work."""
    is_trusted: bool = True
    """Whether the state is."""
    thrust: Sequence[Factors] = ((1.0, 1.0, 1.0),)
    """What thrusters may do, over what they are commanded on each axis: a plan is as good as the worst of it."""


@dataclass(frozen=True)
class WayOut:
    """A decision."""

    burns: Sequence[Burn]
    """Empty for coasting."""
    outcome: Outcome
    coasting: Outcome
    """What would come of coasting."""
    words: str
    """What is flown and why, for people."""

    @property
    def delta_v(self) -> float:
        """m/s."""
        return sum(burn.delta_v for burn in self.burns)


def way_out(situation: Situation, horizon: float = HORIZON, urgent: bool = False) -> WayOut:
    """The least manoeuvre after which coasting is safe for a horizon, s.

    Coasting where that is safe. Otherwise, of burns to relative orbits with parallel vectors that do not drift, and of
    burns along one axis where it is urgent or nothing else is safe, those of least delta-v with a risk below `RISK`; or
    else those of the least risk. A state that is not trusted is not steered by: the satellite retreats along the track
    from all others, where the side that they are on is certain, or coasts, whichever has the lower risk.

    Raises:
        ImpactError: the satellite is on its way down.
        ConfigurationError: a state on no orbit.
    """
    covariance = situation.covariance * (1.0 if situation.is_trusted else DISTRUST**2)
    forecast = Forecast(situation.chief, situation.relative, covariance, situation.others, situation.limit, horizon)
    (coasting,) = forecast.outcomes([()])
    if coasting.risk <= RISK:
        return WayOut((), coasting, coasting, f"coasts: {_told(coasting)}")
    if not situation.is_trusted:
        return _retreat(situation, forecast, coasting)
    plans = _to_safe_orbits(situation, forecast)
    if urgent:
        plans += _pushes(situation, forecast)
    plan, outcome = _best(situation, forecast, plans, coasting)
    if outcome.risk > RISK and not urgent:
        pushed = _best(situation, forecast, _pushes(situation, forecast), coasting)
        plan, outcome = min((plan, outcome), pushed, key=lambda each: each[1].risk)
    if outcome.risk < 0.5 * coasting.risk:
        aim = "coasting that is safe" if outcome.risk <= RISK else "the least risk there is"
        words = f"burns {_sum(plan):.3g} m/s for {aim}: {_told(outcome)}; coasting now, {_told(coasting)}"
        return WayOut(plan, outcome, coasting, words)
    return WayOut((), coasting, coasting, f"coasts, since no manoeuvre lowers the risk: {_told(coasting)}")


def _best(
    situation: Situation, forecast: Forecast, plans: Sequence[Sequence[Burn]], coasting: Outcome
) -> tuple[Sequence[Burn], Outcome]:
    """The plan of least delta-v that is safe, or the one of the least risk; coasting where there is none."""
    worst = _worst(situation, forecast, plans) if plans else []
    found = sorted(zip(plans, worst, strict=True), key=lambda each: _sum(each[0]))
    safe = (each for each in found if each[1].risk <= RISK)
    return next(safe, None) or min(found, key=lambda each: each[1].risk, default=((), coasting))


def _worst(situation: Situation, forecast: Forecast, plans: Sequence[Sequence[Burn]]) -> list[Outcome]:
    """What comes of each plan at worst, by what the thrusters may do."""
    every = [
        forecast.outcomes([[_scaled(burn, factors) for burn in plan] for plan in plans]) for factors in situation.thrust
    ]
    return [max(outcomes, key=lambda each: each.risk) for outcomes in zip(*every, strict=True)]


def _scaled(burn: Burn, factors: Factors) -> Burn:
    x, y, z = (factor * each for factor, each in zip(factors, burn.acceleration, strict=True))
    return replace(burn, acceleration=(x, y, z))


def _sum(plan: Sequence[Burn]) -> float:
    return sum(burn.delta_v for burn in plan)


def _told(outcome: Outcome) -> str:
    return f"{outcome.separation:.3g} m from the nearest after {outcome.seconds:.0f} s, risk {outcome.risk:.1g}"


def _to_safe_orbits(situation: Situation, forecast: Forecast) -> list[Sequence[Burn]]:
    """Manoeuvres to passively safe orbits about the nearest other satellite."""
    n, others = forecast.mean_motion, situation.others
    nearest = others[np.linalg.norm(others[:, :3] - situation.relative[:3], axis=1).argmin()]
    present = elements(situation.relative - nearest, n)
    variances = situation.covariance.diagonal() / np.array([1.0, 1.0, 1.0, n * n, n * n, n * n])
    uncertain = SIGMAS * float(np.sqrt(max(variances[[0, 2, 3, 5]].max(), 0.0)))
    plans: list[Sequence[Burn]] = []
    for factor in CLEARANCES:
        for orbit in safe_orbits(present, factor * (situation.limit + uncertain), n):
            burns = manoeuvre(orbit - present, situation.acceleration, n)
            if burns is None:
                burns = manoeuvre(orbit - present, situation.acceleration, n, revolutions=3)
            if burns:
                plans.append(burns)
    return plans


def _pushes(situation: Situation, forecast: Forecast) -> list[Sequence[Burn]]:
    """Burns along one axis from now on, at full thrust."""
    plans: list[Sequence[Burn]] = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            if situation.acceleration[axis] > 0.0:
                held = [0.0, 0.0, 0.0]
                held[axis] = sign * float(situation.acceleration[axis])
                x, y, z = held
                plans += [[Burn(0.0, length * forecast.step, (x, y, z))] for length in PUSHES]
    return plans


def _retreat(situation: Situation, forecast: Forecast, coasting: Outcome) -> WayOut:
    """Away from all others along the track, where the side that they are on is certain, or coasting."""
    sigma = DISTRUST * float(np.sqrt(max(situation.covariance[1, 1], 0.0)))
    ahead = situation.relative[1] - situation.others[:, 1]
    reason = "the state is not trusted"
    if situation.acceleration[1] > 0.0 and (np.all(ahead > CERTAIN * sigma) or np.all(ahead < -CERTAIN * sigma)):
        # A lower orbit is faster: backwards to get ahead.
        thrust = -float(np.sign(ahead[0])) * float(situation.acceleration[1])
        plans = [[Burn(0.0, length * forecast.step, (0.0, thrust, 0.0))] for length in PUSHES]
        best, outcome = _best(situation, forecast, plans, coasting)
        if outcome.risk < 0.5 * coasting.risk:
            words = (
                f"retreats along the track with {_sum(best):.3g} m/s, since {reason} but for the side of the others: "
                f"{_told(outcome)}; coasting, {_told(coasting)}"
            )
            return WayOut(best, outcome, coasting, words)
        return WayOut((), coasting, coasting, f"coasts: {reason}, and a retreat has no lower risk; {_told(coasting)}")
    return WayOut((), coasting, coasting, f"coasts: {reason}, and no direction is certain; {_told(coasting)}")


class Evasion(Protocol):
    """A plan that is flown tick by tick until its mode ends."""

    @property
    def words(self) -> str:
        """What is flown and why, for people."""

    @property
    def end(self) -> int:
        """Time from which there is no thrust, ns."""

    def force(self, time: int) -> Vector:
        """Force (3,) to hold over the tick that begins at a time (ns), Hill frame, N."""


class Coast:
    """No thrust."""

    def __init__(self, start: int, words: str) -> None:
        """From a time on, ns, for a reason."""
        self.end, self.words = start, words

    def force(self, time: int) -> Vector:
        """None."""
        return NO_FORCE


class Manoeuvre:
    """The burns of a way out, then coasting."""

    def __init__(self, way: WayOut, start: int, mass: float) -> None:
        """From a time on, ns, with a mass, kg."""
        self.words = way.words
        self._burns = [
            (
                start + round(each.begin * NANOSECONDS),
                start + round(each.end * NANOSECONDS),
                mass * np.array(each.acceleration),
            )
            for each in way.burns
        ]
        self.end = max((end for _, end, _ in self._burns), default=start)

    def force(self, time: int) -> Vector:
        """Of the burn that is due."""
        return next((force for begin, end, force in self._burns if begin <= time < end), NO_FORCE)


def plan_evasion(
    mode: Mode,
    time: int,
    estimate: Estimate | None,
    parameters: SupervisorParameters,
    neighbours: Matrix = _CHIEF[:0],
    broken: Collection[str] = (),
    is_trusted: bool = True,
    doubted: Collection[str] | None = None,
) -> Evasion:
    """The plan with which a mode begins.

    Args:
        mode: `avoid` or `safe`.
        time: of the first tick that is flown in it, ns.
        estimate: latest; None where there is none.
        parameters: of supervision.
        neighbours: relative states (N, 6) of the other satellites besides the chief.
        broken: Hill axes that do not work.
        is_trusted: whether the estimate is.
        doubted: axes whose force is told as another than commanded, where the thrust told does not explain the motion:
            it may be to the other side, and there may be none on these. None where it is not doubted.
    """
    if estimate is None:
        return Coast(time, "coasts: there is no state to steer by")
    if not (
        np.isfinite(estimate.covariance).all() and np.isfinite(estimate.relative_state).all() and estimate.mass > 0.0
    ):
        return Coast(time, "coasts: the estimate is not finite")
    limits = [0.0 if axis in broken else each for axis, each in zip(AXES, parameters.thrust_limit, strict=True)]
    situation = Situation(
        estimate.chief_state,
        estimate.relative_state,
        estimate.covariance,
        np.vstack([_CHIEF, neighbours]),
        parameters.least_separation or parameters.tube,
        np.array(limits) / estimate.mass,
        is_trusted,
        _possible(doubted),
    )
    urgent = mode is Mode.AVOID
    horizon = SOON * tau / parameters.mean_motion if urgent else HORIZON
    try:
        way = way_out(situation, horizon, urgent)
    except (ImpactError, ConfigurationError, ValueError) as error:
        return Coast(time, f"coasts: no way out is found, {error}")
    return Manoeuvre(way, time, estimate.mass) if way.burns else Coast(time, way.words)


def _possible(doubted: Collection[str] | None) -> list[Factors]:
    """What thrusters may do: as commanded; where they are doubted, also the opposite, or nothing on some axes."""
    found: list[Factors] = [(1.0, 1.0, 1.0)]
    if doubted is not None:
        found.append((-1.0, -1.0, -1.0))
    if doubted:
        x, y, z = (0.0 if axis in doubted else 1.0 for axis in AXES)
        found.append((x, y, z))
    return found
