"""Where a deputy is to be, now and over the controller's horizon."""

import math
from dataclasses import dataclass, make_dataclass
from typing import Any

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.formation import Formation
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.interface import NANOSECONDS, Estimate, Target
from formation_gnc.mission import LAST_SECOND
from formation_gnc.parameters import parameter
from formation_gnc.part import Part, Schedulable

OUT_OF_REACH = 1e9
"""Distance (m) from the chief that is no formation any more."""


@dataclass(frozen=True)
class GuideParameters(Schedulable):
    """What holds for every formation."""

    formation: str = parameter(
        "leader_follower", choices=tuple(FORMATIONS), in_flight=True, doc="formation in force"
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


class Guide(Part[Any, Formation]):
    """Propagates the target of one deputy along its formation."""

    def design(self, parameters: Any) -> Formation:
        """The named formation with its own parameters; raises ConfigurationError when it is out of reach."""
        name = parameters.formation
        formation = FORMATIONS[name](getattr(parameters, name), parameters.mean_motion)
        orbit = np.linspace(0.0, math.tau / parameters.mean_motion, 8)
        with np.errstate(all="ignore"):
            furthest = np.abs(formation.states(orbit)[:, :3]).max()
        if not furthest < OUT_OF_REACH:  # and so no target overflows, ever
            raise ConfigurationError(
                f"formation {name}: its parameters put a target {furthest:g} m away; "
                f"it must be below {OUT_OF_REACH:g} m over an orbit"
            )
        return formation

    def on_tick(self, estimate: Estimate) -> Target:
        """The target at the estimate's stamp and its preview."""
        self.begin_tick(estimate.time)
        ahead = self.parameters.preview_step * np.arange(self.parameters.preview_steps + 1)
        states = self.configuration.design.states(estimate.time / NANOSECONDS + ahead)
        return Target(
            estimate.time, self.parameters.formation, states[0], self.parameters.preview_step, states[1:]
        )
