"""Where a deputy is to be, now and over the controller's horizon."""

from dataclasses import dataclass, make_dataclass
from typing import Any

import numpy as np

from formation_gnc.guidance.formation import Formation
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.interface import NANOSECONDS, Estimate, Target
from formation_gnc.parameters import parameter
from formation_gnc.part import Part, Schedulable


@dataclass(frozen=True)
class GuideParameters(Schedulable):
    """What holds for every formation."""

    formation: str = parameter(
        "leader_follower", choices=tuple(FORMATIONS), in_flight=True, doc="formation in force"
    )
    preview_steps: int = parameter(0, minimum=0, maximum=10_000, doc="target states given ahead of time")
    preview_step: float = parameter(60.0, unit="s", above=0.0, doc="time between target states given ahead")


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
        """The named formation with its own parameters."""
        return FORMATIONS[parameters.formation](
            getattr(parameters, parameters.formation), parameters.mean_motion
        )

    def on_tick(self, estimate: Estimate) -> Target:
        """The target at the estimate's stamp and its preview."""
        self.begin_tick(estimate.time)
        ahead = self.parameters.preview_step * np.arange(self.parameters.preview_steps + 1)
        states = self.configuration.design.states(estimate.time / NANOSECONDS + ahead)
        return Target(
            estimate.time, self.parameters.formation, states[0], self.parameters.preview_step, states[1:]
        )
