"""Relative navigation of one deputy, from measurement to estimate."""

from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import Configuration, FlightModule, ModuleParameters
from formation_gnc.navigation import kernels
from formation_gnc.navigation.consistency import Consistency, Verdict
from formation_gnc.navigation.filters import FILTERS, RelativeFilter
from formation_gnc.navigation.measurement import NAMES, Readings, StateHistory
from formation_gnc.navigation.measurement_checks import Rejections, Screen, credible_chief, credible_fix
from formation_gnc.navigation.observability import Observability, orbit_period
from formation_gnc.navigation.process import PROCESS_MODELS, Interval, ProcessModel, process_noise, substeps
from formation_gnc.parameters import parameter
from formation_gnc.records import Estimate, EstimateStatus, EventKind, Innovation, Measurement, Rejection, Sensor
from formation_gnc.types import NANOSECONDS, Matrix, Vector

CHIEF_DISTANCE, CHIEF_SPEED = 100.0, 1.0
"""How far (m, m/s) the chief's ephemeris may jump in a tick of a second or more from where gravity with J2
takes it, and in proportion in a shorter one: much more than the model leaves out, much less than a frozen
ephemeris is off."""

GREATEST_ACCELERATION = 100.0
"""What no thruster gives a satellite, m/s^2: an applied force above it is a mistake."""

_NO_ACCELERATION = np.zeros(3)
_UNKNOWN = np.full(6, np.nan)


@dataclass(frozen=True)
class NavigationParameters(ModuleParameters):
    """What the filter believes of its sensors, its start and its model, and how it answers bad input."""

    filter: str = parameter("ekf", choices=tuple(FILTERS), in_flight=True, doc="extended or unscented Kalman filter")
    process_model: str = parameter(
        "nonlinear_j2",
        choices=tuple(PROCESS_MODELS),
        in_flight=True,
        doc="motion that the filter predicts with",
    )
    acceleration_density: float = parameter(
        1e-14,
        unit="m^2/s^3",
        minimum=0.0,
        maximum=1.0,
        in_flight=True,
        doc="power density of the unmodelled acceleration, each axis",
    )
    sensors: tuple[str, ...] = parameter(
        ("radius", "range_rate", "latitude"),
        in_flight=True,
        doc="sensors whose readings are used, of radius, range_rate, latitude, right_ascension, chief_range",
    )
    pseudo_measurements: bool = parameter(
        False,
        in_flight=True,
        doc="take radius, range rate and latitude as r^2 - r_c^2, r r' and r sin(latitude) (Neokleous 3.13), "
        "when all three are there",
    )
    radius_sigma: float = parameter(
        5.0,
        unit="m",
        minimum=1e-6,
        maximum=1e9,
        in_flight=True,
        doc="standard deviation of the radius reading",
    )
    range_rate_sigma: float = parameter(
        0.01,
        unit="m/s",
        minimum=1e-9,
        maximum=1e6,
        in_flight=True,
        doc="standard deviation of the range-rate reading",
    )
    latitude_sigma: float = parameter(
        1e-6,
        unit="rad",
        minimum=1e-12,
        maximum=10.0,
        in_flight=True,
        doc="standard deviation of the latitude reading",
    )
    right_ascension_sigma: float = parameter(
        1e-6,
        unit="rad",
        minimum=1e-12,
        maximum=10.0,
        in_flight=True,
        doc="standard deviation of the right-ascension reading",
    )
    chief_range_sigma: float = parameter(
        1.0,
        unit="m",
        minimum=1e-6,
        maximum=1e9,
        in_flight=True,
        doc="standard deviation of the reading of the distance to the chief",
    )
    fix_position_sigma: float = parameter(
        0.5, unit="m", minimum=1e-6, maximum=1e6, doc="standard deviation of an acquisition fix, each axis"
    )
    fix_velocity_sigma: float = parameter(
        0.0005,
        unit="m/s",
        minimum=1e-9,
        maximum=1e3,
        doc="standard deviation of an acquisition fix, each axis",
    )
    gate: float = parameter(
        5.0,
        minimum=1.0,
        maximum=1e6,
        in_flight=True,
        doc="a reading further from its prediction than so many standard deviations is rejected: chi-square, "
        "one degree of freedom",
    )
    latest: float = parameter(
        60.0,
        unit="s",
        minimum=0.0,
        maximum=3600.0,
        in_flight=True,
        doc="age above which a reading is rejected",
    )
    longest_gap: float = parameter(
        3600.0,
        unit="s",
        above=0.0,
        maximum=1e6,
        in_flight=True,
        doc="time without a measurement beyond which the filter does not predict: it waits for a fix",
    )
    coasting_after: float = parameter(
        60.0,
        unit="s",
        above=0.0,
        in_flight=True,
        doc="time without a reading after which the status says coasting",
    )
    observability_window: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        maximum=1e6,
        in_flight=True,
        doc="time over which the unobservable direction is sought; 0 for one orbit",
    )

    @property
    def legs(self) -> int:
        """Ticks that a reading may be late."""
        return -(-round(self.latest * NANOSECONDS) // self.tick_ns)

    def __post_init__(self) -> None:
        """Raise ConfigurationError for sensors that do not exist or stand twice."""
        super().__post_init__()
        known = list(NAMES.values())
        if not self.sensors or len(set(self.sensors)) != len(self.sensors) or not set(self.sensors) <= set(known):
            raise ConfigurationError(
                f"parameter sensors: {list(self.sensors)} is not allowed; it must be one or more "
                f"different of {', '.join(known)}"
            )


@dataclass(frozen=True, slots=True)
class StepConstants:
    """A time to predict over, and what depends on its length alone."""

    nanoseconds: int
    seconds: float
    substeps: int
    distance: float
    """How far the chief's ephemeris may jump, m."""
    speed: float
    """The same, m/s."""
    noise: Matrix
    """(6, 6) covariance that the process adds."""


def stride(nanoseconds: int, density: float) -> StepConstants:
    """A stride of a length, with process noise of a density (m^2/s^3)."""
    seconds = nanoseconds / NANOSECONDS
    share = min(1.0, seconds)
    return StepConstants(
        nanoseconds,
        seconds,
        substeps(seconds),
        CHIEF_DISTANCE * share,
        CHIEF_SPEED * share,
        process_noise(density, seconds),
    )


@dataclass(frozen=True, slots=True)
class Design:
    """What follows from the parameters."""

    process: ProcessModel
    tick: StepConstants
    variance: dict[int, float]
    """Of the noise of every sensor in use."""
    gate: float
    """Largest innovation squared over its variance."""


@dataclass
class Flight:
    """All that the filter carries from tick to tick."""

    filter: RelativeFilter
    time: int
    """Stamp of the state, ns."""
    chief: Vector
    """(6,) inertial state of the chief, as told or as flown on."""
    mass: float
    track: StateHistory
    screen: Screen
    observability: Observability
    told: Vector = field(default_factory=lambda: _UNKNOWN)
    """(6,) the chief as the ephemeris had it last, believed or not."""
    last_reading: int = 0
    """Stamp at which a reading was last used, ns."""
    consistency: Consistency = field(default_factory=Consistency)
    chief_known: bool = True


@dataclass(frozen=True, slots=True)
class Taken:
    """What became of a tick's readings."""

    innovations: list[Innovation]
    nis: float
    used: int
    """How many readings passed the gate."""


class NavigationFilter(FlightModule[NavigationParameters, Design]):
    """Filter of one deputy, from measurement to estimate.

    It starts from the acquisition fix of a first tick, or of the tick after a missed one when it has lost
    its state. What it is given may be wrong in any way: it is rejected with a reason that is counted, and
    the estimate stays finite, its covariance positive definite. When the readings contradict the state, the
    covariance is inflated; when that does not help, the state is given up: the navigator falls silent,
    which is a missed tick, after which a fix comes.
    """

    def __init__(self, name: str, parameters: NavigationParameters) -> None:
        """Without a state until a fix comes; `name` is the node's, its namespace the deputy's."""
        self._deputy = name.split("/")[-2] if name.count("/") > 1 else ""
        self._flight: Flight | None = None
        self._rejections = Rejections()
        super().__init__(name, parameters)

    def design(self, parameters: NavigationParameters) -> Design:
        """Process model, noise over a tick, variances."""
        used = [sensor for sensor in Sensor if NAMES[sensor] in parameters.sensors]
        return Design(
            PROCESS_MODELS[parameters.process_model](parameters),
            stride(parameters.tick_ns, parameters.acceleration_density),
            {int(sensor): getattr(parameters, f"{NAMES[sensor]}_sigma") ** 2 for sensor in used},
            parameters.gate**2,
        )

    def activate(
        self,
        old: Configuration[NavigationParameters, Design],
        new: Configuration[NavigationParameters, Design],
    ) -> None:
        """Hand the state to another filter; look anew at what is observable."""
        flight = self._flight
        if flight is None:
            return
        if new.parameters.filter != old.parameters.filter:
            flight.filter = FILTERS[new.parameters.filter](flight.filter.x, flight.filter.P)
        if new.parameters.legs != old.parameters.legs:
            flight.track = StateHistory(new.parameters.legs, flight.track)
        if new.design.variance != old.design.variance or (
            new.parameters.observability_window != old.parameters.observability_window
        ):
            flight.observability = self._foresee(flight.chief, flight.filter.x)
            self._report_unobservable(flight)

    def on_tick(self, measurement: Measurement) -> Estimate | None:
        """The estimate at the stamp; none for what is rejected, and while there is no state to start from."""
        acquire = self._acquires(measurement)
        if acquire is None:
            return None
        if acquire and measurement.time < self.time:
            self._rejections = Rejections()  # time runs backwards: a new run
        self.begin_tick(measurement.time)
        if acquire:
            self._acquire(measurement)
        flight = self._flight
        assert flight is not None
        try:
            if not acquire:
                self._predict(flight, measurement)
            status = EstimateStatus.ACQUIRED if acquire else EstimateStatus.TRACKING
            estimate = self._update(flight, measurement, status)
        except (ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
            self._give_up(measurement.time, f"{type(error).__name__}: {error}")
            estimate = None
        for subject, detail in self._rejections.news():
            self.log(measurement.time, EventKind.REJECTED, detail, subject)
        return estimate

    def _acquires(self, measurement: Measurement) -> bool | None:
        """Whether to start from the measurement's fix, or to go on; None: it is not to be used at all."""
        reject = self._rejections.add
        if measurement.deputy not in ("", self._deputy):
            reject(Rejection.WRONG_DEPUTY, "measurement", f"of {measurement.deputy}")
            return None
        fix = self._can_acquire(measurement)
        if measurement.fix_available and not fix:
            reject(Rejection.FIX, "acquisition fix")
        flight = self._flight
        if flight is None:
            return True if fix else None
        gap = measurement.time - flight.time
        if gap == self.configuration.design.tick.nanoseconds:
            return False
        if gap == 0:
            reject(Rejection.DUPLICATE, "measurement")
            return None
        if gap < 0 or gap > self.parameters.longest_gap * NANOSECONDS:
            if fix:
                return True
            reject(Rejection.OUT_OF_ORDER if gap < 0 else Rejection.FUTURE, "measurement")
            return None
        return False

    def _can_acquire(self, measurement: Measurement) -> bool:
        return (
            measurement.fix_available
            and credible_chief(measurement.chief_state)
            and credible_fix(measurement.fix, measurement.chief_state)
        )

    def _acquire(self, measurement: Measurement) -> Flight:
        parameters = self.parameters
        covariance = np.diag(np.repeat([parameters.fix_position_sigma**2, parameters.fix_velocity_sigma**2], 3))
        mass = measurement.mass if _can_weigh(measurement.mass) else 1.0
        self._flight = flight = Flight(
            filter=FILTERS[parameters.filter](np.array(measurement.fix), covariance),
            time=measurement.time,
            chief=measurement.chief_state,
            mass=mass,
            track=StateHistory(parameters.legs),
            screen=Screen(self._rejections),
            observability=self._foresee(measurement.chief_state, measurement.fix),
            told=measurement.chief_state,
            last_reading=measurement.time,
        )
        self.log(measurement.time, EventKind.ACQUIRED, "filter started from an acquisition fix")
        self._report_unobservable(flight)
        return flight

    def _foresee(self, chief: Vector, state: Vector) -> Observability:
        window = self.parameters.observability_window or orbit_period(chief)
        return Observability(chief, state, self.configuration.design.variance, window, self.parameters.mean_motion)

    def _report_unobservable(self, flight: Flight) -> None:
        words = flight.observability.words
        self.log(
            flight.time,
            EventKind.OBSERVABILITY,
            f"unobservable direction: {words}" if words else "everything is observable",
        )

    def _predict(self, flight: Flight, measurement: Measurement) -> None:
        """Fly to the measurement's stamp, through ticks that never arrived on the way."""
        tick = self.configuration.design.tick
        gap = measurement.time - flight.time
        # Ticks that never arrived were missed ones: no thrust, and the chief flew on as the model says.
        while gap > tick.nanoseconds:
            self._fly(flight, _UNKNOWN, _NO_ACCELERATION, tick)
            gap -= tick.nanoseconds
        if gap < tick.nanoseconds:
            tick = stride(gap, self.parameters.acceleration_density)
        self._fly(flight, measurement.chief_state, self._acceleration(flight, measurement), tick)
        self._watch_chief(flight, measurement)
        if not kernels.sound(flight.filter.x, flight.filter.P):
            raise ArithmeticError("the prediction is not finite")

    def _fly(self, flight: Flight, told: Vector, acceleration: Vector, over: StepConstants) -> None:
        chief, flight.chief_known = _follow(flight.chief, told, over)
        leg = Interval(flight.chief, chief, acceleration, over.seconds, over.substeps)
        transition = flight.filter.fly(self.configuration.design.process, leg, over.noise)
        flight.track.add(leg)
        flight.chief = chief
        flight.time += over.nanoseconds
        words = flight.observability.words
        if flight.observability.fly(transition, over.seconds) and flight.observability.words != words:
            self._report_unobservable(flight)

    def _acceleration(self, flight: Flight, measurement: Measurement) -> Vector:
        """Of the thrust over the tick that has ended; none where it is not known."""
        if not _can_weigh(measurement.mass):
            self._rejections.add(Rejection.AVIONICS, "mass")
        else:
            flight.mass = measurement.mass
        acceleration: Vector = measurement.applied_force / flight.mass
        x, y, z = acceleration.tolist()
        within = x * x + y * y + z * z <= GREATEST_ACCELERATION**2  # false for what is not a number
        if not within:
            self._rejections.add(Rejection.AVIONICS, "applied force")
            return _NO_ACCELERATION
        return acceleration

    def _watch_chief(self, flight: Flight, measurement: Measurement) -> None:
        """Reject an ephemeris that jumped, unless it has gone on from where it jumped to as an orbit does."""
        told, flight.told = flight.told, measurement.chief_state
        if flight.chief_known:
            return
        if (
            credible_chief(told)
            and credible_chief(flight.told)
            and _follow(told, flight.told, self.configuration.design.tick)[1]
        ):
            state = kernels.relative_to(flight.chief, flight.filter.x, flight.told)
            flight.filter = FILTERS[self.parameters.filter](state, flight.filter.P)
            flight.chief, flight.chief_known = flight.told, True
            self.log(flight.time, EventKind.CHIEF, "ephemeris goes on from elsewhere: taken up again")
            return
        self._rejections.add(Rejection.CHIEF, "chief ephemeris")

    def _update(self, flight: Flight, measurement: Measurement, status: EstimateStatus) -> Estimate | None:
        """Take the readings, judge the filter by them, and answer; no answer when the state is given up."""
        taken = self._take(flight, measurement)
        if taken is not None:
            verdict, factor = flight.consistency.judge(taken.nis, taken.used, len(taken.innovations) - taken.used)
            if verdict is Verdict.GIVE_UP:
                self._give_up(measurement.time, "readings contradict the state, however uncertain")
                return None
            if verdict is Verdict.INFLATE and self._can_acquire(measurement):
                return self._update(self._acquire(measurement), measurement, EstimateStatus.ACQUIRED)
            if verdict is Verdict.INFLATE:
                flight.filter.P = flight.filter.P * factor
                self.log(measurement.time, EventKind.DIVERGED, f"covariance inflated by {factor:.3g}")
                status = EstimateStatus.DIVERGED
        if status is EstimateStatus.TRACKING:
            if not flight.chief_known:
                status = EstimateStatus.CHIEF_LOST
            elif flight.time - flight.last_reading > self.parameters.coasting_after * NANOSECONDS:
                status = EstimateStatus.COASTING
        return Estimate(
            time=measurement.time,
            relative_state=flight.filter.x,
            covariance=flight.filter.P,
            chief_state=flight.chief,
            mass=flight.mass,
            eclipse=measurement.eclipse,
            innovations=taken.innovations if taken else [],
            nis=taken.nis if taken else 0.0,
            status=int(status),
            rejections=self._rejections.counts,
            unobservable_direction=flight.observability.direction,
            unobservable=flight.observability.words,
        )

    def _take(self, flight: Flight, measurement: Measurement) -> Taken | None:
        """Update with the readings that pass; none when there is nothing to weigh.

        Raises ArithmeticError when the result is not finite.
        """
        if not measurement.readings:
            return None
        variance, latest = self.configuration.design.variance, self.parameters.latest
        readings = flight.screen.admit(measurement, variance, latest, flight.chief, flight.track)
        if readings is None:
            return None
        readings, jacobian, innovations = self._weigh(flight, readings)
        if jacobian is None:
            return Taken(innovations, 0.0, 0)
        flight.observability.take(jacobian, readings.variance)
        nis = flight.filter.correct(self._pseudo(readings))
        if not (kernels.sound(flight.filter.x, flight.filter.P) and isfinite(nis)):
            raise ArithmeticError("the update is not finite")
        flight.last_reading = flight.time
        return Taken(innovations, nis, len(readings.value))

    @np.errstate(all="ignore")  # whatever a reading says; what comes of it is compared
    def _weigh(self, flight: Flight, readings: Readings) -> tuple[Readings, Matrix | None, list[Innovation]]:
        """The readings that pass the gate, their Jacobian, and the innovations of all; no Jacobian without any."""
        offset, variance, jacobian = flight.filter.weigh(readings)
        gate = self.configuration.design.gate
        passed = [each * each <= gate * spread for each, spread in zip(offset.tolist(), variance.tolist(), strict=True)]
        innovations = self._innovations(readings, offset, variance)
        if all(passed):
            return readings, jacobian, innovations
        for innovation, fits in zip(innovations, passed, strict=True):
            if not fits:
                self._reject(innovation)
        if not any(passed):
            return readings, None, innovations
        readings = readings.select(np.array(passed))
        offset, variance, jacobian = flight.filter.weigh(readings)
        used = iter(self._innovations(readings, offset, variance))
        return readings, jacobian, [each if each.rejection else next(used) for each in innovations]

    def _innovations(self, readings: Readings, offset: Vector, variance: Vector) -> list[Innovation]:
        sigma = np.sqrt(variance)
        columns = readings.sensor, offset, sigma, np.abs(offset) / sigma / self.parameters.gate
        return [
            Innovation(NAMES[Sensor(sensor)], [value], [deviation], test_ratio)
            for sensor, value, deviation, test_ratio in zip(*(each.tolist() for each in columns), strict=True)
        ]

    def _reject(self, innovation: Innovation) -> None:
        """Reject the reading of an innovation that is beyond the gate."""
        if isfinite(innovation.test_ratio):
            distance = innovation.test_ratio * self.parameters.gate
            reason, detail = Rejection.GATE, f"{distance:.1f} standard deviations off"
        else:
            reason, detail = Rejection.NO_DIRECTION, ""
        innovation.rejection = reason
        self._rejections.add(reason, innovation.sensor, detail)

    def _pseudo(self, readings: Readings) -> bool:
        if not self.parameters.pseudo_measurements or readings.late:
            return False
        return {Sensor.RADIUS, Sensor.RANGE_RATE, Sensor.LATITUDE} <= set(readings.sensor.tolist())

    def _give_up(self, time: int, why: str) -> None:
        """Lose the state: without an estimate the tick is missed, and the next measurement has a fix."""
        self._flight = None
        self.log(time, EventKind.LOST, f"{why}: waiting for an acquisition fix")


def _follow(chief: Vector, told: Vector, over: StepConstants) -> tuple[Vector, bool]:
    """The chief after a stride: as told if it can be there, else as the model has it; and whether it can."""
    if kernels.can_be_there(chief, told, over.seconds, over.substeps, over.distance, over.speed):
        return told, True
    return kernels.coast(chief, _NO_ACCELERATION, over.seconds, over.substeps), False


def _can_weigh(mass: float) -> bool:
    return isfinite(mass) and mass > 1e-6
