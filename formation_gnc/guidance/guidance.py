"""Where a deputy is to be, now and over the controller's horizon."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, make_dataclass, replace
from functools import lru_cache
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from formation_gnc.common import LAST_SECOND
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import Configuration, FlightModule, ModuleParameters, Plan
from formation_gnc.guidance.fleet import assign_slots, path_to, places_for
from formation_gnc.guidance.prediction import in_words, predict
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.guidance.targets import TARGET_MODELS, TargetPath
from formation_gnc.guidance.transfer import LONGEST, shortest_time
from formation_gnc.orbit.eclipse import eclipses
from formation_gnc.orbit.propagation import ImpactError
from formation_gnc.parameters import parameter
from formation_gnc.records import NO_ECLIPSES, NO_NEIGHBOURS, EventKind, NavigationState, Separation, Target
from formation_gnc.types import NANOSECONDS, Times, Vector

LARGEST_ERROR = 0.05
"""Error of the target's model in a revolution, as a share of the formation's size, above which it is told."""

ECLIPSE_STEPS = 180
"""Points of a revolution at which the chief is looked at for eclipses."""

NEVER = -LAST_SECOND * NANOSECONDS
"""Time (ns) long before every run."""

TAKEN = 0.05
"""Distance, with a rate of as much a radian, within which another satellite has a place at least, as a share
of the formation's size: more than control leaves, less than places are apart."""

OUT_OF_REACH = 1e9
"""Distance (m) from the chief that is no formation any more."""


@dataclass(frozen=True)
class BaseGuidanceParameters(ModuleParameters):
    """What holds for every formation."""

    formation: str = parameter("leader_follower", choices=tuple(FORMATIONS), in_flight=True, doc="formation in force")
    slot: int = parameter(0, minimum=0, maximum=1000, in_flight=True, doc="the deputy's place in the formation, from 0")
    phase: float = parameter(
        0.0, unit="rad", in_flight=True, doc="how far round the whole formation is at the start of the run"
    )
    model: str = parameter(
        "hill", choices=tuple(TARGET_MODELS), in_flight=True, doc="relative motion that the target moves by"
    )
    reconfiguration_time: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        maximum=LAST_SECOND,
        in_flight=True,
        doc="time to reach a changed target: less than the thrusters need is told, and no other change is "
        "taken meanwhile; 0 for no hurry",
    )
    fleet: tuple[str, ...] = parameter(
        (),
        doc="names of all satellites of the formation, the deputy's too: their estimates are waited for; "
        "none: it flies by itself",
    )
    assignment: str = parameter(
        "fixed",
        choices=("fixed", "delta_v", "fuel"),
        doc="who takes which place: fixed by slot and phase; delta_v shares them out over the fleet, phase "
        "included, for the least sum, at the start and at every change; with fuel, a delta-v counts in "
        "inverse proportion to what the tank holds",
    )
    dry_masses: tuple[float, ...] = parameter(
        (), unit="kg", minimum=0.0, doc="mass of each of the fleet with an empty tank, for assignment by fuel"
    )
    separation_warning: float = parameter(
        0.0,
        unit="m",
        minimum=0.0,
        in_flight=True,
        doc="predicted distance to another of the fleet below which an event warns; 0 for none",
    )
    separation_interval: float = parameter(
        60.0,
        unit="s",
        above=0.0,
        in_flight=True,
        doc="time between predictions of the distances in the fleet",
    )
    separation_horizon: float = parameter(
        2.0,
        above=0.0,
        maximum=100.0,
        in_flight=True,
        doc="revolutions for which distances are predicted if no thruster fires",
    )
    thrust_limit: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01),
        unit="N",
        length=3,
        minimum=0.0,
        doc="largest force per Hill axis, for the shortest time to a changed target",
    )
    preview_steps: int = parameter(0, minimum=0, maximum=10_000, doc="target states given ahead of time")
    preview_step: float = parameter(
        60.0, unit="s", minimum=1e-9, maximum=LAST_SECOND, doc="time between target states given ahead"
    )


GuidanceParameters: Any = make_dataclass(
    "GuidanceParameters",
    [(name, formation.Parameters) for name, formation in FORMATIONS.items()],
    bases=(BaseGuidanceParameters,),
    frozen=True,
    kw_only=True,
    namespace={"__doc__": "Parameters of the guidance node: what holds for every formation, and each one's own."},
)


class Guidance(FlightModule[Any, TargetPath]):
    """Carries the target of one deputy forward along its formation.

    Tells, as events, a model that does not serve the formation, and at every change of target how far it is
    and how soon the thrusters can be there.
    """

    def __init__(self, name: str, parameters: Any) -> None:
        """Design the path; raises ConfigurationError when there is none, or a fleet without the deputy."""
        self._deputy = name.rpartition("/")[0].strip("/")
        if parameters.fleet and self._deputy not in parameters.fleet:
            raise ConfigurationError(
                f"parameter fleet: {list(parameters.fleet)} is not allowed; {self._deputy} must be one of it"
            )
        if len(set(parameters.fleet)) != len(parameters.fleet):
            raise ConfigurationError(
                f"parameter fleet: {list(parameters.fleet)} is not allowed; no name may come twice"
            )
        self.neighbours = tuple(each for each in parameters.fleet if each != self._deputy)
        super().__init__(name, parameters)

    def _start(self) -> None:
        self._until = 0
        super()._start()
        self._unassigned = self.parameters.assignment != "fixed"
        self._untold = True
        self._left: str | None = None

    def reset(self) -> None:
        """Nothing has been looked for yet, eclipses or others that come near."""
        self._eclipses, self._eclipse_due = NO_ECLIPSES, NEVER
        self._predicted, self._warned = NEVER, False
        self._waits_for = ""
        self._known: Mapping[str, NavigationState] = {}
        self._neighbours: Mapping[str, TargetPath] = {}

    def design(self, parameters: Any) -> TargetPath:
        """The path of the named formation's place, with its own parameters, in the named model."""
        kind, own = FORMATIONS[parameters.formation], getattr(parameters, parameters.formation)
        places = kind.places(own)
        if places is not None and parameters.slot >= places:
            raise ConfigurationError(
                f"parameter slot: {parameters.slot} is not allowed; it must be below {places}, "
                f"the places of {parameters.formation}"
            )
        if parameters.assignment != "fixed":
            _check_assignment(parameters)
        orbit = np.linspace(0.0, math.tau / parameters.mean_motion, 8)
        with np.errstate(all="ignore"):
            path = path_to(parameters, parameters.slot, parameters.phase)
            furthest = np.abs(path.states(orbit)[:, :3]).max()
        if not furthest < OUT_OF_REACH:  # and so no target overflows, ever
            raise ConfigurationError(
                f"formation {parameters.formation}: its parameters put a target {furthest:g} m away; "
                f"it must be below {OUT_OF_REACH:g} m over an orbit"
            )
        if path.error()[1] == 0.0:
            raise ConfigurationError(
                f"formation {parameters.formation}: its size is zero; it must keep the deputy off the chief"
            )
        return path

    def stage(self, changes: Mapping[str, Any]) -> Configuration[Any, TargetPath]:
        """As :meth:`FlightModule.prepare`; rejects another target while a change that was given a time is under way,
        and where it would be another for one of the fleet alone."""
        if self._time < self._until and not _are_aside(changes):
            raise ConfigurationError(self._under_way(self._until))
        if self.parameters.assignment != "fixed" and not _are_aside(changes):
            raise ConfigurationError(
                f"assignment is {self.parameters.assignment}: the whole fleet changes at one tick, and so by "
                "schedule only; the target stays"
            )
        prepared = super().stage(changes)
        self._check_that_nobody_is_there(prepared)
        return prepared

    def _check_that_nobody_is_there(self, prepared: Configuration[Any, TargetPath]) -> None:
        """Reject a target that another of the fleet holds."""
        if _is_same(self.configuration, prepared, self._time):
            return
        target = prepared.design.states(np.array([self._time / NANOSECONDS]))[0]
        room = max(TAKEN * prepared.design.error()[1], prepared.parameters.separation_warning)
        reach = room * np.repeat([1.0, prepared.parameters.mean_motion], 3)
        for name, each in self._known.items():
            if (np.abs(each.relative_state - target) < reach).all():
                raise ConfigurationError(
                    f"place {prepared.parameters.slot} of {prepared.parameters.formation}: {name} is there, "
                    f"within {room:g} m; each must have its own, and the target stays"
                )

    def _plan(self, start: Configuration[Any, TargetPath], over: float) -> Plan[Any, TargetPath]:
        """As :meth:`FlightModule._plan`; rejects two changes of target of which the second comes too soon."""
        plan, until = super()._plan(start, over), self._until
        for (_, old), (at, new) in pairwise([(0, start), *plan]):
            if not _is_same(old, new, at):
                if at < until:
                    raise ConfigurationError(
                        f"parameter schedule: a change at {at / NANOSECONDS:g} s is not allowed; "
                        + self._under_way(until)
                    )
                until = at + round(new.parameters.reconfiguration_time * NANOSECONDS)
        return plan

    def _let_take_over(self, time: int, due: Configuration[Any, TargetPath]) -> bool:
        if time < self._until and not _are_aside(due.changes):
            self.log(time, EventKind.REJECTED, self._under_way(self._until))
            return False
        return super()._let_take_over(time, due)

    @staticmethod
    def _under_way(until: int) -> str:
        return f"a reconfiguration is under way until {until / NANOSECONDS:g} s; the target stays"

    def activate(self, old: Configuration[Any, TargetPath], new: Configuration[Any, TargetPath]) -> None:
        """Remember what is left, if the target changes at all."""
        if _is_same(old, new, self._time):
            return
        self._unassigned, self._neighbours = new.parameters.assignment != "fixed", {}
        self._untold, self._left = True, old.parameters.formation
        self._until = self._time + round(new.parameters.reconfiguration_time * NANOSECONDS)

    def on_tick(self, estimate: NavigationState, *others: NavigationState | None) -> tuple[Target, Separation | None]:
        """The target at the estimate's stamp, and how near the others will come when that is due.

        Args:
            estimate: of this deputy.
            others: of the others of its fleet, in the fleet's order, at the same stamp; None for one that is
                silent.
        """
        self.begin_tick(estimate.time)
        self._known = known = {
            name: each
            for name, each in zip(self.neighbours, others, strict=True)
            if each is not None and _is_near(each)
        }
        if self._unassigned:
            self._take_place(estimate, known)
        times = estimate.time / NANOSECONDS + _ahead(self.parameters.preview_step, self.parameters.preview_steps)
        states = self.configuration.design.states(times)
        if self._untold:
            self._untold = False
            self._tell_of_the_model(estimate.time)
            if self._left is not None:
                self._tell_of_the_change(estimate, states[0])
        target = Target(
            estimate.time,
            self.parameters.formation,
            states[0],
            round(self.parameters.preview_step * NANOSECONDS),
            states[1:],
            self._coming_eclipses(estimate),
            np.array([each.relative_state for each in known.values()]) if known else NO_NEIGHBOURS,
        )
        return target, self._predict(estimate, target, list(known))

    def _take_place(self, estimate: NavigationState, known: Mapping[str, NavigationState]) -> None:
        """Take this deputy's place of those that are shared out over the fleet."""
        parameters, fleet = self.parameters, {**known, self._deputy: estimate}
        silent = [name for name in parameters.fleet if name not in fleet]
        if silent or not _is_near(estimate):
            who = ", ".join(silent) or self._deputy
            if who != self._waits_for:
                self._waits_for = who
                self.log(estimate.time, EventKind.WARNING, "no state: places stay until there is", who)
            return
        self._unassigned, self._waits_for = False, ""
        states = np.array([fleet[name].relative_state for name in parameters.fleet])
        masses = np.array([fleet[name].mass for name in parameters.fleet])
        shared = assign_slots(parameters, estimate.time / NANOSECONDS, states, masses)
        index = parameters.fleet.index(self._deputy)
        place = {"slot": shared.slots[index], "phase": shared.phase}
        self.configuration = self._design_from(parameters, place)
        self._neighbours = {
            name: path_to(parameters, slot, shared.phase)
            for name, slot in zip(parameters.fleet, shared.slots, strict=True)
        }
        self.log(
            estimate.time,
            EventKind.ASSIGNMENT,
            f"place {shared.slots[index]}, phase {shared.phase:.4f} rad, "
            f"{shared.delta_v[index]:.3g} m/s of the fleet's {sum(shared.delta_v):.3g} m/s",
            parameters.formation,
        )

    def _predict(self, estimate: NavigationState, target: Target, names: list[str]) -> Separation | None:
        """How near the others will come, now and then; warns when that is too near."""
        if not names:
            return None
        parameters = self.parameters
        due = estimate.time - self._predicted >= parameters.separation_interval * NANOSECONDS
        if not (due and _is_near(estimate)):
            return None
        self._predicted = estimate.time
        separation = predict(
            self.configuration.design,
            target,
            estimate.relative_state,
            names,
            self._neighbours,
            parameters.separation_horizon,
            parameters.mean_motion,
        )
        warns = min(separation.planned, separation.passive) < parameters.separation_warning
        if warns != self._warned:
            self._warned = warns
            nearest = separation.nearest if warns else ""
            self.log(estimate.time, EventKind.SEPARATION, in_words(separation) if warns else "over", nearest)
        return separation

    def _coming_eclipses(self, estimate: NavigationState) -> Times:
        """Eclipses of the chief (N, 2), ns, looked for two revolutions ahead in every revolution.

        A chief without an orbit has none that are new; they are looked for again at the next point.
        """
        seconds = estimate.time / NANOSECONDS
        if estimate.time >= self._eclipse_due:
            wait = revolution = math.tau / self.parameters.mean_motion
            try:
                ahead = eclipses(
                    estimate.chief_state,
                    2.0 * revolution,
                    revolution / ECLIPSE_STEPS,
                    self.parameters.epoch + seconds,
                )
                self._eclipses = estimate.time + np.rint(ahead * NANOSECONDS).astype(np.int64)
            except ImpactError:  # or a state that is not finite
                wait /= ECLIPSE_STEPS
            self._eclipse_due = estimate.time + round(wait * NANOSECONDS)
        while len(self._eclipses) and self._eclipses[0, 1] <= estimate.time:
            self._eclipses = self._eclipses[1:]
        return self._eclipses

    def _tell_of_the_model(self, time: int) -> None:
        error, size = self.configuration.design.error()
        if error > LARGEST_ERROR * size:
            self.log(
                time,
                EventKind.WARNING,
                f"in model {self.parameters.model}: off by {error:.3g} m in the first revolution, "
                f"at {size:.3g} m from the chief",
                self.parameters.formation,
            )

    def _tell_of_the_change(self, estimate: NavigationState, target: Vector) -> None:
        to_go = estimate.relative_state - target
        if not (np.isfinite(to_go).all() and estimate.mass > 0.0):
            return
        parameters = self.parameters
        acceleration = np.array(parameters.thrust_limit) / estimate.mass
        soonest = shortest_time(to_go, acceleration, parameters.mean_motion)
        words = f"{soonest:.0f} s" if math.isfinite(soonest) else f"more than {LONGEST} revolutions"
        detail = (
            f"from {self._left} to place {parameters.slot}: "
            f"{np.linalg.norm(to_go[:3]):.0f} m to go, for which the thrusters need {words}"
        )
        if 0.0 < parameters.reconfiguration_time < soonest:
            kind, detail = EventKind.INFEASIBLE, f"{detail}, not {parameters.reconfiguration_time:g} s"
        else:
            kind = EventKind.RECONFIGURATION
        self.log(estimate.time, kind, detail, parameters.formation)


@lru_cache(maxsize=16)
def _ahead(step: float, steps: int) -> Vector:
    """(1 + steps,) times (s) of a target and its preview from the tick on."""
    ahead: Vector = step * np.arange(steps + 1.0)
    return ahead


def _are_aside(changes: Mapping[str, Any]) -> bool:
    """Whether changes leave the target alone for now, whatever their values."""
    return all(name == "schedule" or name.startswith("separation_") for name in changes)


def _is_same(old: Configuration[Any, TargetPath], new: Configuration[Any, TargetPath], time: int) -> bool:
    """Whether a change at a time (ns) leaves the target as it is; for a fleet that shares places out, whether
    it does for whoever is in it."""
    if new.parameters.assignment != "fixed":
        return _are_aside(new.changes)
    now = np.array([time / NANOSECONDS])
    return np.array_equal(old.design.states(now), new.design.states(now))


def _is_near(estimate: NavigationState) -> bool:
    """Whether state and mass are finite, and such as a satellite in formation can have."""
    return bool((np.abs(estimate.relative_state) < OUT_OF_REACH).all() and 0.0 < estimate.mass < math.inf)


def _check_assignment(parameters: Any) -> None:
    """Reject an assignment that no fleet could fly."""
    count, places = len(parameters.fleet), places_for(parameters)
    if not count:
        raise ConfigurationError(
            f"parameter assignment: {parameters.assignment} is not allowed without a fleet; name it"
        )
    if places < count:
        raise ConfigurationError(
            f"formation {parameters.formation}: {places} places for a fleet of {count}; each must have one"
        )
    if parameters.assignment == "fuel" and len(parameters.dry_masses) != count:
        raise ConfigurationError(
            f"parameter dry_masses: {list(parameters.dry_masses)} is not allowed; it must have one for each "
            f"of the fleet of {count}"
        )


def check_places(deputies: Mapping[str, Any]) -> None:
    """Reject two satellites on one place, at the start or after any scheduled change, and a fleet at odds.

    Args:
        deputies: parameters of the guidance of each, by name.

    Raises:
        ConfigurationError: two have one target, a fleet has a name that does not fly, or its members are not
            told the same.
    """
    for name, parameters in deputies.items():
        strangers = [each for each in parameters.fleet if each not in deputies]
        if strangers:
            raise ConfigurationError(f"{name}: fleet has {', '.join(strangers)}, who must be one of the deputies")
        for mate in parameters.fleet if parameters.assignment != "fixed" else ():
            if replace(deputies[mate], slot=0, phase=0.0) != replace(parameters, slot=0, phase=0.0):
                raise ConfigurationError(
                    f"{name} and {mate}: their places are shared out, so that their parameters of guidance "
                    "must be the same but for slot and phase"
                )
    deputies = {name: each for name, each in deputies.items() if each.assignment == "fixed"}
    guides = {name: Guidance(f"/{name}/guidance", parameters) for name, parameters in deputies.items()}
    for time in sorted({0, *(at for guide in guides.values() for at, _ in guide.foreseen)}):
        states = {}
        for name, guide in guides.items():
            guide.begin_tick(time)
            states[name] = guide.configuration.design.states(np.array([time / NANOSECONDS]))[0]
        for one, other in combinations(guides, 2):
            if np.linalg.norm((states[one] - states[other])[:3]) < 1e-3 and np.allclose(
                states[one][3:], states[other][3:], rtol=0.0, atol=1e-6
            ):
                parameters = guides[one].parameters
                raise ConfigurationError(
                    f"{one} and {other} are on one place from {time / NANOSECONDS:g} s: "
                    f"{parameters.formation}, slot {parameters.slot}; each must have its own"
                )
