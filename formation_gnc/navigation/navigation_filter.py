"""Relative navigation of one deputy, from measurement to estimate."""

from collections.abc import Sequence
from dataclasses import replace
from enum import Enum

import numpy as np

from formation_gnc.flight.mode import ModeInForce
from formation_gnc.flight.module import Configuration, FlightModule
from formation_gnc.mode_records import CHIEF, STATE, ModeState, RestrictionKind
from formation_gnc.navigation.adaptive_noise import AdaptiveNoise
from formation_gnc.navigation.consistency import UPDATES_TO_DIVERGE, Verdict
from formation_gnc.navigation.filter_state import Design, FilterState, acquire, expected_observability
from formation_gnc.navigation.filters import FILTERS, load
from formation_gnc.navigation.kernels.linear_algebra import are_finite
from formation_gnc.navigation.measurement_checks import (
    Rejections,
    has_plausible_fix,
    is_plausible_acceleration,
    is_plausible_mass,
)
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.navigation.process import PROCESS_MODELS, Interval
from formation_gnc.navigation.reading_update import UpdateResult, update
from formation_gnc.navigation.state_history import StateHistory
from formation_gnc.navigation.step import StepConstants, step_constants
from formation_gnc.records import Estimate, EstimateStatus, EventKind, Measurement, Rejection
from formation_gnc.types import NANOSECONDS, Vector

SILENT_AFTER = 10.0
"""Time without a valid reading after which a sensor in use is reported, in terms of `coasting_after`."""

_NO_ACCELERATION = np.zeros(3)


class _Action(Enum):
    """What a measurement is used for."""

    IGNORE = "ignore"
    ACQUIRE = "acquire"
    PREDICT = "predict"


class NavigationFilter(FlightModule[NavigationParameters, Design]):
    """Navigation filter of one deputy.

    It starts from the acquisition fix of the first tick, or of the tick after a missed one if its state is lost.
    Invalid input is rejected and counted by reason; the estimate stays finite, its covariance positive definite.
    When readings contradict the state, the covariance is inflated; if that does not help, the state is lost: the
    filter gives no estimate, which is a missed tick, after which a fix comes.
    """

    def __init__(self, name: str, parameters: NavigationParameters) -> None:
        """Without a state until a fix comes; `name` is the node's, its namespace the deputy's."""
        self._deputy = name.split("/")[-2] if name.count("/") > 1 else ""
        self._state: FilterState | None = None
        self._lost_chief: tuple[int, Vector] | None = None
        self._said_that_it_waits = False
        self._rejections = Rejections()
        super().__init__(name, parameters)

    def reset(self) -> None:
        """No mode has been said; the state waits for a fix to end."""
        self._mode = ModeInForce()
        self._isolated: tuple[str, ...] = ()
        """Sensors that are left out by restriction."""
        self._restricted: tuple[str, ...] = ()  # with chief and state

    def design(self, parameters: NavigationParameters) -> Design:
        """Process model, constants of a tick, variances."""
        load(parameters.filter)
        return Design(
            PROCESS_MODELS[parameters.process_model](parameters),
            step_constants(parameters.tick_ns, parameters.acceleration_density),
            {name: tuple(each**2 for each in sigma) for name, sigma in parameters.sigmas.items()},
            parameters.gate**2,
            round(parameters.coasting_after * NANOSECONDS),
            round(SILENT_AFTER * parameters.coasting_after * NANOSECONDS),
        )

    def activate(
        self,
        old: Configuration[NavigationParameters, Design],
        new: Configuration[NavigationParameters, Design],
    ) -> None:
        """Hand the state to another filter; start a new observability window for other sensors."""
        state, parameters = self._state, new.parameters
        if state is None:
            return
        if parameters.filter != old.parameters.filter:
            state.filter = FILTERS[parameters.filter](state.filter.state, state.filter.covariance)
        if parameters.latest_ticks != old.parameters.latest_ticks:
            state.history = StateHistory(parameters.latest_ticks, state.history)
        has_other_sensors = new.design.variance != old.design.variance
        if has_other_sensors:
            state.noise = AdaptiveNoise()
        if has_other_sensors or parameters.observability_window != old.parameters.observability_window:
            self._begin_observability(state)

    @property
    def _design(self) -> Design:
        """The design, without the sensors that are isolated."""
        design = self.configuration.design
        return replace(design, variance=self._left(self._isolated)) if self._isolated else design

    def _left(self, isolated: Sequence[str]) -> dict[str, tuple[float, ...]]:
        """Variances of the sensors in use besides the isolated ones."""
        return {name: each for name, each in self.configuration.design.variance.items() if name not in isolated}

    def _obey(self, time: int) -> None:
        """Leave out what the mode says at a time (ns), or take it up again; no sensor where no other would be left."""
        before, restricted = self._restricted, self._mode.without(RestrictionKind.SENSOR)
        self._restricted = restricted
        if self._state is not None and STATE in restricted and STATE not in before:
            self._lose(time, "the supervisor does not trust the state")
        if self._state is not None and (CHIEF in restricted) != (CHIEF in before):
            self._isolate_chief(self._state)
        isolated = tuple(each for each in restricted if each not in (CHIEF, STATE))
        isolated = isolated if self._left(isolated) else ()
        if isolated == self._isolated:
            return
        self._isolated = isolated
        if self._state is not None:
            self._state.noise = AdaptiveNoise()
            self._begin_observability(self._state)

    def on_tick(self, measurement: Measurement, mode: ModeState | None = None) -> Estimate | None:
        """Estimate at the measurement's stamp; none for a measurement that is ignored, and without a state.

        mode: of the tick before; None for the one that stands.
        """
        if self._mode.take(mode):
            self._obey(measurement.time)
        action = self._action(measurement)
        if action is _Action.IGNORE:
            return None
        if action is _Action.ACQUIRE and measurement.time < self.time:
            self._rejections = Rejections()  # time runs backwards: a new run
        self.begin_tick(measurement.time)
        status = EstimateStatus.TRACKING
        if action is _Action.ACQUIRE:
            self._acquire(measurement)
            status = EstimateStatus.ACQUIRED
        state = self._state
        assert state is not None
        try:
            if action is _Action.PREDICT:
                self._predict(state, measurement)
            estimate = self._estimate(state, measurement, status)
        except (ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
            self._lose(measurement.time, f"{type(error).__name__}: {error}")
            estimate = None
        for subject, detail in self._rejections.take_reports():
            self.log(measurement.time, EventKind.REJECTED, detail, subject)
        for subject, detail in state.take_reports(self._design, measurement.time):
            self.log(measurement.time, EventKind.WARNING, detail, subject)
        return estimate

    def _action(self, measurement: Measurement) -> _Action:
        """Decide by deputy, fix and stamp."""
        reject = self._rejections.add
        if measurement.deputy not in ("", self._deputy):
            reject(Rejection.WRONG_DEPUTY, "measurement", f"of {measurement.deputy}")
            return _Action.IGNORE
        has_fix = has_plausible_fix(measurement)
        if measurement.fix_available and not has_fix:
            reject(Rejection.FIX, "acquisition fix")
        if self._state is None:
            if not has_fix:
                self._await_fix(measurement.time)
            return _Action.ACQUIRE if has_fix else _Action.IGNORE
        gap = measurement.time - self._state.time
        if gap == self.configuration.design.step.nanoseconds:
            return _Action.PREDICT
        if gap == 0:
            reject(Rejection.DUPLICATE, "measurement")
            return _Action.IGNORE
        if 0 < gap <= self.parameters.longest_gap * NANOSECONDS:
            return _Action.PREDICT
        if has_fix:
            return _Action.ACQUIRE
        reject(Rejection.OUT_OF_ORDER if gap < 0 else Rejection.FUTURE, "measurement")
        return _Action.IGNORE

    def first_of(self, waiting: Sequence[Measurement]) -> Measurement:
        """The last with an acquisition fix, without a state; the last otherwise."""
        if self._state is None:
            return next((each for each in reversed(waiting) if has_plausible_fix(each)), waiting[-1])
        return waiting[-1]

    @property
    def waiting_for(self) -> str:
        """An acquisition fix, without a state."""
        return "an acquisition fix" if self._state is None else ""

    def _await_fix(self, time: int) -> None:
        if not self._said_that_it_waits:
            self._said_that_it_waits = True
            self.log(time, EventKind.WARNING, "no estimate before a measurement has an acquisition fix", "fix")

    def _acquire(self, measurement: Measurement) -> FilterState:
        self._said_that_it_waits = False
        own = self._own_chief() if CHIEF in self._restricted else None
        self._state = acquire(measurement, self.parameters, self._design, self._rejections, own)
        self.log(measurement.time, EventKind.ACQUIRED, "filter started from an acquisition fix")
        self._report_observability(self._state)
        return self._state

    def _begin_observability(self, state: FilterState) -> None:
        """Begin a new window with the sensors in use."""
        state.observability = expected_observability(
            state.chief.state, state.filter.state, self.parameters, self._design
        )
        self._report_observability(state)

    def _report_observability(self, state: FilterState) -> None:
        words = state.observability.words
        detail = f"unobservable direction: {words}" if words else "everything is observable"
        self.log(state.time, EventKind.OBSERVABILITY, detail)

    def _predict(self, state: FilterState, measurement: Measurement) -> None:
        """Predict to the measurement's stamp, tick by tick where some were missed."""
        step = self.configuration.design.step
        gap = measurement.time - state.time
        while gap > step.nanoseconds:  # missed ticks: no thrust, no ephemeris
            self._predict_step(state, None, _NO_ACCELERATION, step)
            gap -= step.nanoseconds
        if gap < step.nanoseconds:
            step = step_constants(gap, self.parameters.acceleration_density)
        self._predict_step(state, measurement.chief_state, self._acceleration(state, measurement), step)
        if state.chief.is_lost:
            self._resume_chief(state)
        if not are_finite(state.filter.state, state.filter.covariance):
            raise ArithmeticError("the prediction is not finite")

    def _predict_step(
        self, state: FilterState, ephemeris: Vector | None, acceleration: Vector, step: StepConstants
    ) -> None:
        start = state.chief.state
        interval = Interval(start, state.chief.advance(ephemeris, step), acceleration, step.seconds, step.substeps)
        transition = state.filter.predict(self.configuration.design.process, interval, step.noise)
        state.history.add(interval)
        state.time += step.nanoseconds
        words = state.observability.words
        state.noise.propagate(transition)
        if state.observability.propagate(transition, step.seconds) and state.observability.words != words:
            self._report_observability(state)

    def _acceleration(self, state: FilterState, measurement: Measurement) -> Vector:
        """Acceleration by thrust over the tick that has ended, from its mass; zero where it is not plausible."""
        before = state.mass if state.is_mass_known else None
        if is_plausible_mass(measurement.mass, before):
            state.mass, state.is_mass_known = measurement.mass, True
        else:
            self._rejections.add(Rejection.AVIONICS, "mass")
        mass = before or state.mass
        x, y, z = measurement.applied_force.tolist()
        acceleration = x / mass, y / mass, z / mass  # numbers: half the time of an array
        if is_plausible_acceleration(*acceleration):
            return np.array(acceleration)
        self._rejections.add(Rejection.AVIONICS, "applied force")
        return _NO_ACCELERATION

    def _resume_chief(self, state: FilterState) -> None:
        """Reject an ephemeris that jumped, until it has moved on along an orbit."""
        if state.resume_chief(self.configuration.design.step, self.parameters.filter):
            self.log(state.time, EventKind.CHIEF, "ephemeris goes on from elsewhere: taken up again")
        else:
            self._rejections.add(Rejection.CHIEF, "chief ephemeris")

    def _isolate_chief(self, state: FilterState) -> None:
        if state.chief.is_isolated:
            state.chief.is_isolated = False
            return self._resume_chief(state)
        age = state.isolate_chief(self.parameters.filter)
        self.log(state.time, EventKind.CHIEF, f"ephemeris is isolated: propagated from that of {age:.0f} s before")

    def _estimate(self, state: FilterState, measurement: Measurement, status: EstimateStatus) -> Estimate | None:
        """Update with the readings, and check consistency; none when the state is lost."""
        result = self._update(state, measurement)
        if result is not None:
            rejected = [each.sensor for each in result.innovations if each.rejection == Rejection.GATE]
            verdict, factor = state.consistency.judge(
                result.nis,
                result.used,
                result.rejected,
                state.noise.explains_excess,
                lambda: state.noise.are_white(rejected, UPDATES_TO_DIVERGE),
            )
            state.filter.covariance = state.noise.correct(state.filter.covariance)
            if verdict is Verdict.GIVE_UP:
                self._lose(measurement.time, "readings contradict the state, however uncertain")
                return None
            if verdict is Verdict.INFLATE and has_plausible_fix(measurement):
                return self._estimate(self._acquire(measurement), measurement, EstimateStatus.ACQUIRED)
            if verdict is Verdict.INFLATE:
                state.filter.covariance = state.observability.inflate(state.filter.covariance, factor)
                state.noise.forget_readings()
                self.log(measurement.time, EventKind.DIVERGED, f"covariance inflated by {factor:.3g}")
                status = EstimateStatus.DIVERGED
        if status is EstimateStatus.TRACKING:
            if state.chief.is_lost:
                status = EstimateStatus.CHIEF_LOST
            elif state.time - state.last_reading > self.configuration.design.coasting_after:
                status = EstimateStatus.COASTING
        # Positional: keyword arguments take twice as long.
        return Estimate(
            measurement.time,
            state.filter.state,
            state.chief.state,
            state.mass,
            state.filter.covariance,
            measurement.eclipse,
            result.innovations if result else [],
            result.nis if result else 0.0,
            int(status),
            self._rejections.counts,
            state.observability.direction,
            state.observability.words,
        )

    def _update(self, state: FilterState, measurement: Measurement) -> UpdateResult | None:
        """Update with the readings that are valid and within the gate; none without a valid reading."""
        if not measurement.readings:
            return None
        parameters, design = self.parameters, self.configuration.design
        readings = state.checks.accept(
            measurement.readings,
            measurement.time,
            state.noise.scaled(design.variance),
            parameters.latest,
            state.chief.state,
            state.history,
        )
        if readings is None:
            return None
        pseudo = parameters.pseudo_measurements
        return update(state, readings, design.gate, pseudo, self._rejections, self._isolated)

    def _own_chief(self) -> tuple[int, Vector] | None:
        """The chief (6,) that is propagated, with its time, ns; that of the state before, where that is lost."""
        return self._lost_chief if self._state is None else (self._state.time, self._state.chief.state)

    def _lose(self, time: int, reason: str) -> None:
        """Lose the state: without an estimate the tick is missed, and the next measurement has a fix."""
        self._lost_chief = self._own_chief()
        self._state, self._said_that_it_waits = None, True
        self.log(time, EventKind.LOST, f"{reason}: waiting for an acquisition fix")
