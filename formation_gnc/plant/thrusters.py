"""Thrusters of a deputy: the force applied for a commanded one."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import copysign, exp, hypot, isfinite

import numpy as np

from formation_gnc.errors import ParameterError
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix, Vector

NO_FORCE = (0.0, 0.0, 0.0)

STANDARD_GRAVITY = 9.80665
"""Defines specific impulse in seconds, m/s^2."""


@dataclass(frozen=True)
class ThrusterParameters:
    """Limits and imperfections of the thrusters along the three Hill axes; zeros mean an ideal actuator."""

    limit: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01), unit="N", length=3, minimum=0.0, doc="largest force per Hill axis"
    )
    total_limit: float = parameter(
        0.0,
        unit="N",
        minimum=0.0,
        doc="largest magnitude of one gimballed thruster; 0 for one thruster per axis",
    )
    dead_band: float = parameter(0.0, unit="N", minimum=0.0, doc="command per axis below which nothing fires")
    minimum_impulse: float = parameter(
        0.0, unit="N s", minimum=0.0, doc="smallest impulse per axis and tick; a smaller one does not fire"
    )
    quantum: float = parameter(0.0, unit="N", minimum=0.0, doc="step between forces per axis; 0 for continuous")
    lag: float = parameter(0.0, unit="s", minimum=0.0, doc="time constant of the force's rise and fall")
    misalignment: float = parameter(
        0.0,
        unit="rad",
        minimum=0.0,
        maximum=0.5,
        doc="standard deviation of the mounting error about each axis",
    )
    magnitude_noise: float = parameter(
        0.0,
        minimum=0.0,
        maximum=1.0,
        doc="standard deviation of the force per axis and tick, as a fraction of it",
    )
    specific_impulse: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        doc="exhaust velocity over standard gravity; 0 for thrust that costs no mass",
    )
    dry_mass: float = parameter(0.0, unit="kg", minimum=0.0, doc="mass at which the tank is empty")
    off_in_eclipse: bool = parameter(False, doc="no thrust while any of the Sun is hidden")
    failed: tuple[bool, ...] = parameter((False, False, False), length=3, doc="axes whose thruster does not fire")


class Denial(StrEnum):
    """Why the applied force differs from the command."""

    NOT_FINITE = "command not finite"
    ECLIPSE = "eclipse"
    EMPTY = "empty tank"
    FAILED = "failed axis"
    LIMIT = "limit"
    TOO_SMALL = "below dead band or minimum impulse"


@dataclass(frozen=True, slots=True)
class ThrusterState:
    """State of a thruster between ticks."""

    mass: float
    """Of the whole satellite, kg."""
    output: tuple[float, float, float] = NO_FORCE
    """State of the lag: force at the end of the tick, before noise and misalignment, N."""


class Thruster:
    """Force of a deputy's thrusters over a tick.

    In this order: a command that is not finite, eclipse (if configured) or an empty tank cuts all thrust at
    once, a failed axis its own. The rest is limited, rounded to the quantum, dropped where it is too small,
    delayed by the lag, disturbed by noise and rotated by the misalignment. The force is the mean over the tick,
    so that the impulse is exact with a lag too. When the tank runs dry within a tick, the force is that of the
    remaining propellant.

    Assumes: thrusters fixed to the Hill axes, constant exhaust velocity.
    """

    def __init__(self, parameters: ThrusterParameters, tick: float, generator: np.random.Generator) -> None:
        """Mount the thrusters.

        Args:
            parameters: may be replaced in flight; the misalignment is drawn here, once.
            tick: s.
            generator: random numbers of this deputy's thrusters alone.

        Raises:
            ParameterError: a quantum above the largest force, or too fine to count.
        """
        largest = max(*parameters.limit, parameters.total_limit)
        if parameters.quantum and not 1e-9 * largest <= parameters.quantum <= largest:
            raise ParameterError(
                f"parameter quantum: {parameters.quantum!r} N is not allowed; "
                f"it must be 0 or from {1e-9 * largest:g} to the largest force, {largest:g}"
            )
        self.parameters = parameters
        self.tick, self._generator = tick, generator
        self._mounting = rotation_about(parameters.misalignment * generator.standard_normal(3))

    def start(self, mass: float) -> ThrusterState:
        """State before the first tick.

        Args:
            mass: with propellant, kg.

        Raises:
            ParameterError: a mass that is not above zero, or below the dry mass.
        """
        if not (isfinite(mass) and mass > 0.0):
            raise ParameterError(f"parameter mass: {mass!r} kg is not allowed; it must be above 0")
        if mass < self.parameters.dry_mass:
            raise ParameterError(
                f"parameter mass: {mass!r} kg is not allowed; it must be at least the dry mass, "
                f"{self.parameters.dry_mass!r} kg"
            )
        return ThrusterState(mass)

    def apply(
        self, command: Sequence[float], eclipse: bool, state: ThrusterState
    ) -> tuple[Sequence[float], ThrusterState, tuple[Denial, ...]]:
        """Fire for one tick.

        Args:
            command: commanded force, (3,), Hill frame, N.
            eclipse: whether any of the Sun is hidden.
            state: at the start of the tick.

        Returns:
            The applied force, (3,), Hill frame, N, held over the tick with the mass at its start; the state at
            its end; and why the force differs from the command beyond lag, rounding, noise and misalignment.
        """
        force, state, reasons = self.fire(command, eclipse, state)
        limits = self.parameters
        if force is NO_FORCE or not (limits.specific_impulse or limits.misalignment):  # most often, nothing to do
            return force, state, reasons
        return self.expel(force, state, reasons)

    def fire(
        self, command: Sequence[float], eclipse: bool, state: ThrusterState
    ) -> tuple[Sequence[float], ThrusterState, tuple[Denial, ...]]:
        """As `apply`, up to the noise: propellant and mounting are left to `expel`.

        The force is NO_FORCE itself where all thrust is denied.
        """
        limits = self.parameters
        noise = self._generator.standard_normal(3) if limits.magnitude_noise > 0.0 else None
        denial = self._denial(command, eclipse, state.mass)
        if denial is not None:
            return NO_FORCE, ThrusterState(state.mass), (denial,) if any(command) else ()
        force, reasons = self._valves(command)
        if limits.lag > 0.0:
            force, end = lagged(state.output, force, limits.lag, self.tick)
            state = ThrusterState(state.mass, end)
        if noise is not None:
            force = [f * (1.0 + limits.magnitude_noise * float(n)) for f, n in zip(force, noise, strict=True)]
        return force, state, reasons

    def expel(
        self,
        force: Sequence[float],
        state: ThrusterState,
        reasons: tuple[Denial, ...],
        leak: Sequence[float] | None = None,
        rotation: Matrix | None = None,
    ) -> tuple[Sequence[float], ThrusterState, tuple[Denial, ...]]:
        """Second half of `apply`: use propellant and turn the force.

        Args:
            force: from `fire`, (3,), N.
            state: from `fire`.
            reasons: from `fire`.
            leak: force of what leaves beside the thrusters, (3,), Hill frame, N.
            rotation: of the thrusters' forces beyond their mounting error, (3, 3).
        """
        limits = self.parameters
        if limits.specific_impulse > 0.0:
            mass, fraction = self._burn(force, state.mass, leak)
            state = ThrusterState(mass, state.output)
            if fraction < 1.0:
                reasons += (Denial.EMPTY,)
                force, state = [f * fraction for f in force], ThrusterState(mass)
                leak = leak and [f * fraction for f in leak]
        if limits.misalignment > 0.0:
            force = (self._mounting @ np.array(force)).tolist()
        if rotation is not None:
            force = (rotation @ np.array(force)).tolist()
        if leak is not None:
            force = [f + more for f, more in zip(force, leak, strict=True)]
        return force, state, reasons

    def _denial(self, command: Sequence[float], eclipse: bool, mass: float) -> Denial | None:
        limits = self.parameters
        if not all(map(isfinite, command)):
            return Denial.NOT_FINITE
        if eclipse and limits.off_in_eclipse:
            return Denial.ECLIPSE
        if limits.specific_impulse > 0.0 and mass <= limits.dry_mass:
            return Denial.EMPTY
        return None

    def _valves(self, command: Sequence[float]) -> tuple[list[float], tuple[Denial, ...]]:
        """Force (3,) that the valves are set to, N, and what was denied of the command."""
        limits = self.parameters
        reasons: list[Denial] = []
        output: list[float] = []
        for axis, value in enumerate(command):
            limit = limits.limit[axis]
            if limits.failed[axis] and value != 0.0:
                reasons.append(Denial.FAILED)
                value = 0.0
            if abs(value) > limit:
                reasons.append(Denial.LIMIT)
                value = copysign(limit, value)
            output.append(value)
        if 0.0 < limits.total_limit < (total := hypot(*output)):
            reasons.append(Denial.LIMIT)
            output = [value * limits.total_limit / total for value in output]
        coarse = limits.quantum > 0.0 or limits.dead_band > 0.0 or limits.minimum_impulse > 0.0
        for axis, value in enumerate(output if coarse else ()):
            level = abs(value)
            if limits.quantum > 0.0:
                # Towards zero where rounding would break the limit.
                steps = min(round(level / limits.quantum), int(limits.limit[axis] / limits.quantum + 1e-9))
                level = steps * limits.quantum
            if abs(value) < limits.dead_band or level * self.tick < limits.minimum_impulse:
                if value != 0.0:
                    reasons.append(Denial.TOO_SMALL)
                level = 0.0
            output[axis] = copysign(level, value)
        return output, tuple(dict.fromkeys(reasons)) if reasons else ()

    def _burn(self, force: Sequence[float], mass: float, leak: Sequence[float] | None) -> tuple[float, float]:
        """Mass after the tick, kg, and the fraction of the force that the propellant is enough for."""
        limits = self.parameters
        thrust = hypot(*force) if limits.total_limit > 0.0 else sum(abs(each) for each in force)
        if leak is not None:
            thrust += hypot(*leak)
        needed = thrust * self.tick / (limits.specific_impulse * STANDARD_GRAVITY)
        if needed <= mass - limits.dry_mass:
            return mass - needed, 1.0
        return limits.dry_mass, (mass - limits.dry_mass) / needed


def lagged(
    before: tuple[float, float, float], output: Sequence[float], lag: float, tick: float
) -> tuple[list[float], tuple[float, float, float]]:
    """Mean force over a tick, and the force at its end, of a first-order lag.

    Args:
        before: force at the start of the tick, (3,), N.
        output: force that it tends to, (3,), N.
        lag: time constant, s.
        tick: s.
    """
    left = exp(-tick / lag)
    mean = lag / tick * (1.0 - left)
    given = [to + (now - to) * mean for now, to in zip(before, output, strict=True)]
    x, y, z = (to + (now - to) * left for now, to in zip(before, output, strict=True))
    return given, (x, y, z)


def rotation_about(vector: Vector) -> Matrix:
    """Rotation matrix about a vector by its length (Rodrigues)."""
    x, y, z = vector
    angle = float(np.linalg.norm(vector))
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # Limits of sin(a)/a and (1 - cos a)/a^2 at zero are left to NumPy's sinc.
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    rotation: Matrix = np.eye(3) + first * cross + second * cross @ cross
    return rotation
