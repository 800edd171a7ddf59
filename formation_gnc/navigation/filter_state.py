"""What the navigation filter carries from tick to tick, and its start from an acquisition fix."""

from dataclasses import dataclass, field

import numpy as np

from formation_gnc.navigation.adaptive_noise import AdaptiveNoise
from formation_gnc.navigation.chief_tracker import ChiefTracker
from formation_gnc.navigation.consistency import Consistency
from formation_gnc.navigation.filters import FILTERS, RelativeFilter
from formation_gnc.navigation.kernels.motion import change_chief
from formation_gnc.navigation.measurement_checks import ReadingChecks, Rejections, is_plausible_mass
from formation_gnc.navigation.observability import Observability, orbit_period
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.navigation.process import ProcessModel
from formation_gnc.navigation.state_history import StateHistory
from formation_gnc.navigation.step import StepConstants
from formation_gnc.records import Measurement
from formation_gnc.types import NANOSECONDS, Vector


@dataclass(frozen=True, slots=True)
class Design:
    """What follows from the parameters."""

    process: ProcessModel
    step: StepConstants
    """Of a tick."""
    variance: dict[str, tuple[float, ...]]
    """Of the noise of each value of a reading, by sensor in use."""
    gate: float
    """Largest accepted innovation squared over its variance."""
    coasting_after: int
    """Time (ns) without a used reading after which the filter counts as coasting."""
    silent_after: int
    """Time (ns) without a valid reading after which a sensor in use is reported."""


@dataclass
class FilterState:
    """State of the filter, from an acquisition fix on."""

    filter: RelativeFilter
    time: int
    """Stamp of the state, ns."""
    chief: ChiefTracker
    mass: float
    """Last plausible mass, kg."""
    is_mass_known: bool
    """Whether there was one."""
    history: StateHistory
    checks: ReadingChecks
    observability: Observability
    start: int
    """Stamp of the acquisition fix, ns."""
    last_reading: int
    """Stamp at which a reading was last used, ns."""
    consistency: Consistency = field(default_factory=Consistency)
    noise: AdaptiveNoise = field(default_factory=AdaptiveNoise)

    def take_reports(self, design: Design, time: int) -> list[tuple[str, str]]:
        """Sensors that are noisier than their parameters, or silent, at a time (ns), with what to say of each."""
        silences = self.checks.take_silences(design.variance, self.start, time, design.silent_after)
        return self.noise.take_reports() + silences

    def isolate_chief(self, kind: str) -> float:
        """Go on without the chief's ephemeris, from an earlier one, with a filter of a kind; returns its age, s."""
        age, relative = self.chief.isolate(self.filter.state)
        self.filter = FILTERS[kind](relative, self.filter.covariance)
        return age

    def resume_chief(self, step: StepConstants, kind: str) -> bool:
        """Return to an ephemeris that jumped, with the deputy where it is; returns whether it has moved on an orbit."""
        before = self.chief.state
        if not self.chief.resume(step):
            return False
        relative = change_chief(before, self.filter.state, self.chief.state)
        self.filter = FILTERS[kind](relative, self.filter.covariance)
        return True


def acquire(
    measurement: Measurement,
    parameters: NavigationParameters,
    design: Design,
    rejections: Rejections,
    own_chief: tuple[int, Vector] | None = None,
) -> FilterState:
    """State of the filter from a measurement with a plausible acquisition fix.

    own_chief: time (ns) and state (6,) of the chief that is propagated, as its ephemeris is isolated.
    """
    chief = ChiefTracker(measurement.chief_state)
    if own_chief is not None:
        chief = ChiefTracker.propagated(own_chief[1], (measurement.time - own_chief[0]) / NANOSECONDS)
    is_mass_known = is_plausible_mass(measurement.mass)
    variance = [parameters.fix_position_sigma**2, parameters.fix_velocity_sigma**2]
    return FilterState(
        filter=FILTERS[parameters.filter](np.array(measurement.fix), np.diag(np.repeat(variance, 3))),
        time=measurement.time,
        chief=chief,
        mass=measurement.mass if is_mass_known else 1.0,
        is_mass_known=is_mass_known,
        history=StateHistory(parameters.latest_ticks),
        checks=ReadingChecks(rejections),
        observability=expected_observability(chief.state, measurement.fix, parameters, design),
        start=measurement.time,
        last_reading=measurement.time,
    )


def expected_observability(
    chief: Vector, state: Vector, parameters: NavigationParameters, design: Design
) -> Observability:
    """Observability with the sensors in use, from chief and relative state (6,) on."""
    window = parameters.observability_window or orbit_period(chief)
    return Observability(chief, state, design.variance, window, parameters.mean_motion)
