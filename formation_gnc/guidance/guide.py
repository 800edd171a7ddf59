"""Where a deputy is to be, now and over the controller's horizon."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, make_dataclass
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.guidance.targets import TARGET_MODELS, TargetPath
from formation_gnc.guidance.transfer import LONGEST, shortest_time
from formation_gnc.interface import NANOSECONDS, NO_ECLIPSE, Estimate, Matrix, Target, Vector
from formation_gnc.mission import LAST_SECOND
from formation_gnc.orbit.eclipse import eclipses
from formation_gnc.orbit.propagation import ImpactError
from formation_gnc.parameters import parameter
from formation_gnc.part import Configuration, Part, Schedulable

LARGEST_ERROR = 0.05
"""Error of the target's model in a revolution, as a share of the formation's size, above which it is told."""

ECLIPSE_STEPS = 180
"""Points of a revolution at which the chief is looked at for eclipses."""

OUT_OF_REACH = 1e9
"""Distance (m) from the chief that is no formation any more."""


@dataclass(frozen=True)
class GuideParameters(Schedulable):
    """What holds for every formation."""

    formation: str = parameter(
        "leader_follower", choices=tuple(FORMATIONS), in_flight=True, doc="formation in force"
    )
    slot: int = parameter(
        0, minimum=0, maximum=1000, in_flight=True, doc="the deputy's place in the formation, from 0"
    )
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
    thrust_limit: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01),
        unit="N",
        length=3,
        minimum=0.0,
        doc="largest force per Hill axis, for the shortest time to a changed target",
    )
    preview_steps: int = parameter(0, minimum=0, maximum=10_000, doc="target states given ahead of time")
    preview_step: float = parameter(
        60.0, unit="s", above=0.0, maximum=LAST_SECOND, doc="time between target states given ahead"
    )


GuidanceParameters: Any = make_dataclass(
    "GuidanceParameters",
    [(name, formation.Parameters) for name, formation in FORMATIONS.items()],
    bases=(GuideParameters,),
    frozen=True,
    kw_only=True,
    namespace={
        "__doc__": "Parameters of the guidance node: what holds for every formation, and each one's own."
    },
)


class Guide(Part[Any, TargetPath]):
    """Carries the target of one deputy forward along its formation.

    Tells, as events, a model that does not serve the formation, and at every change of target how far it is
    and how soon the thrusters can be there.
    """

    def _start(self) -> None:
        super()._start()
        self._untold = True
        self._left: str | None = None
        self._until = 0

    def forget(self) -> None:
        """No eclipse has been looked for yet."""
        self._eclipse, self._eclipse_looked_for = NO_ECLIPSE, -LAST_SECOND * NANOSECONDS

    def design(self, parameters: Any) -> TargetPath:
        """The path of the named formation's place, with its own parameters, in the named model."""
        kind, own = FORMATIONS[parameters.formation], getattr(parameters, parameters.formation)
        places = kind.places(own)
        if places is not None and parameters.slot >= places:
            raise ConfigurationError(
                f"parameter slot: {parameters.slot} is not allowed; it must be below {places}, "
                f"the places of {parameters.formation}"
            )
        orbit = np.linspace(0.0, math.tau / parameters.mean_motion, 8)
        with np.errstate(all="ignore"):
            formation = kind(own, parameters.mean_motion, parameters.slot)
            path = TARGET_MODELS[parameters.model](formation, parameters.phase, parameters)
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

    def prepare(self, changes: Mapping[str, Any]) -> Configuration[Any, TargetPath]:
        """As :meth:`Part.prepare`; refuses while a change that was given a time is under way."""
        if self._time < self._until:
            raise ConfigurationError(self._under_way())
        return super().prepare(changes)

    def _let_take_over(self, time: int, due: Configuration[Any, TargetPath]) -> bool:
        if time < self._until:
            self.record(time, "refused", self._under_way())
            return False
        return super()._let_take_over(time, due)

    def _under_way(self) -> str:
        return f"a reconfiguration is under way until {self._until / NANOSECONDS:g} s; the target stays"

    def take_over(self, old: Configuration[Any, TargetPath], new: Configuration[Any, TargetPath]) -> None:
        """Remember what is left, if the target changes at all."""
        now = np.array([self._time / NANOSECONDS])
        if np.array_equal(old.design.states(now), new.design.states(now)):
            return
        self._untold, self._left = True, old.parameters.formation
        self._until = self._time + round(new.parameters.reconfiguration_time * NANOSECONDS)

    def on_tick(self, estimate: Estimate) -> Target:
        """The target at the estimate's stamp and its preview."""
        self.begin_tick(estimate.time)
        times = estimate.time / NANOSECONDS + _ahead(
            self.parameters.preview_step, self.parameters.preview_steps
        )
        states = self.configuration.design.states(times)
        if self._untold:
            self._untold = False
            self._tell_of_the_model(estimate.time)
            if self._left is not None:
                self._tell_of_the_change(estimate, states[0])
        return Target(
            estimate.time,
            self.parameters.formation,
            states[0],
            self.parameters.preview_step,
            states[1:],
            self._coming_eclipse(estimate),
        )

    def _coming_eclipse(self, estimate: Estimate) -> Matrix:
        """Eclipses of the chief, looked for two revolutions ahead in every revolution."""
        revolution = math.tau / self.parameters.mean_motion
        seconds = estimate.time / NANOSECONDS
        if estimate.time - self._eclipse_looked_for >= revolution * NANOSECONDS:
            self._eclipse_looked_for = estimate.time
            try:
                self._eclipse = seconds + eclipses(
                    estimate.chief_state,
                    2.0 * revolution,
                    revolution / ECLIPSE_STEPS,
                    self.parameters.epoch + seconds,
                )
            except ImpactError:  # the estimate's chief flies nowhere: nothing is known
                self._eclipse = NO_ECLIPSE
        while len(self._eclipse) and self._eclipse[0, 1] <= seconds:
            self._eclipse = self._eclipse[1:]
        return self._eclipse

    def _tell_of_the_model(self, time: int) -> None:
        error, size = self.configuration.design.error()
        if error > LARGEST_ERROR * size:
            self.record(
                time,
                "warning",
                f"{self.parameters.formation} in model {self.parameters.model}: off by {error:.3g} m in "
                f"the first revolution, at {size:.3g} m from the chief",
            )

    def _tell_of_the_change(self, estimate: Estimate, target: Vector) -> None:
        to_go = estimate.relative_state - target
        if not (np.isfinite(to_go).all() and estimate.mass > 0.0):
            return
        parameters = self.parameters
        acceleration = np.array(parameters.thrust_limit) / estimate.mass
        soonest = shortest_time(to_go, acceleration, parameters.mean_motion)
        words = f"{soonest:.0f} s" if math.isfinite(soonest) else f"more than {LONGEST} revolutions"
        detail = (
            f"{self._left} -> {parameters.formation}, place {parameters.slot}: "
            f"{np.linalg.norm(to_go[:3]):.0f} m to go, for which the thrusters need {words}"
        )
        if 0.0 < parameters.reconfiguration_time < soonest:
            self.record(estimate.time, "infeasible", f"{detail}, not {parameters.reconfiguration_time:g} s")
        else:
            self.record(estimate.time, "reconfiguration", detail)

    @property
    def foreseen(self) -> list[int]:
        """Times (ns) of the changes that are scheduled and still to come."""
        return [at for at, _ in self._foreseen]


@lru_cache(maxsize=16)
def _ahead(step: float, steps: int) -> Vector:
    """(1 + steps,) times (s) of a target and its preview from the tick on."""
    ahead: Vector = step * np.arange(steps + 1.0)
    return ahead


def check_places(deputies: Mapping[str, Any]) -> None:
    """Refuse two satellites on one place, at the start or after any scheduled change.

    Args:
        deputies: parameters of the guidance of each, by name.

    Raises:
        ConfigurationError: two have one target.
    """
    guides = {name: Guide(f"/{name}/guidance", parameters) for name, parameters in deputies.items()}
    for time in sorted({0, *(at for guide in guides.values() for at in guide.foreseen)}):
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
