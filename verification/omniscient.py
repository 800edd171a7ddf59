"""What flies on the truth in place of estimates."""

from collections.abc import Sequence

import numpy as np

from formation_gnc.mode_records import ModeState
from formation_gnc.plant.plant import Plant
from formation_gnc.records import Estimate, EstimateStatus, Event, Measurement


class Omniscient:
    """Stands where the navigation does, and gives the truth as the estimate, in any mode."""

    events: Sequence[Event] = ()

    def __init__(self, plant: Plant, name: str) -> None:
        """For a deputy of this plant."""
        self._plant, self._index = plant, plant.parameters.deputies.index(name)
        self.events: list[Event] = []
        """None ever."""

    def take_events(self) -> list[Event]:
        """Nothing happens to it."""
        return []

    def on_tick(self, measurement: Measurement, mode: ModeState | None = None) -> Estimate:
        """The true state at the tick."""
        deputy = self._plant.truth().deputies[self._index]
        return Estimate(
            time=measurement.time,
            relative_state=deputy.relative_state,
            covariance=np.zeros((6, 6)),
            chief_state=measurement.chief_state,
            mass=measurement.mass,
            eclipse=measurement.eclipse,
            innovations=[],
            nis=0.0,
            status=EstimateStatus.TRACKING,
        )
