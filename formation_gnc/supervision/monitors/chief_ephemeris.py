"""The chief's ephemeris against its own propagation."""

from collections.abc import Sequence
from math import dist, hypot

from formation_gnc.mode_records import CHIEF
from formation_gnc.records import EstimateStatus
from formation_gnc.supervision.kernels import NOISE, WINDOW, largest_unmodelled
from formation_gnc.supervision.monitor import Monitor, Observation
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.types import NANOSECONDS

CLEAN = 300.0
"""Time that an ephemeris has to follow an orbit after an alarm, s."""


class ChiefEphemeris(Monitor):
    """Distance of the ephemeris from its propagation since the start of one of two windows of five minutes.

    Bound: a metre and 1/2 a t^2, with a what acts beyond point mass and J2 at most: 4e-4 m/s^2 in low orbit. A
    propagation that the ephemeris has left goes on for up to fifty minutes; the ephemeris is well again after five
    minutes beside it. While navigation propagates the chief itself, the ephemeris must lie within the bound of a whole
    window of that as well, 20 m in low orbit: so a slow drift does not become well by lasting.

    Assumes: a chief without thrust, and an ephemeris that is good to a metre.
    Cannot see: another orbit that is followed from the start; in low orbit a drift below 3 cm/s.
    Delay: the first comparison after 20 s at 5 cm/s, the first one from 0.2 m/s on and of one that is frozen.
    """

    name = "chief_ephemeris"
    title = "chief's ephemeris against its own propagation"
    test = "bound, a metre and what acts beyond J2, within windows of five minutes"

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The chief."""
        return (CHIEF,)

    def prepare(self) -> None:
        """Well until told otherwise."""
        self._failed_at = -round(CLEAN * NANOSECONDS)

    def feed(self, observation: Observation) -> None:
        """Judge where there is a comparison, or navigation has lost the chief."""
        estimate = observation.estimate
        is_lost = estimate is not None and estimate.status == EstimateStatus.CHIEF_LOST
        reckoning = observation.reckoning
        ratio = 0.0 if reckoning is None else reckoning.chief
        if ratio >= 1.0 or is_lost or self._is_apart(observation):
            self._failed_at = observation.time
        elif reckoning is None:
            return
        is_failed = observation.time - self._failed_at < CLEAN * NANOSECONDS
        self.judge(CHIEF, max(ratio, 1.0) if is_failed else ratio, 0.5, 1.0)

    def _is_apart(self, observation: Observation) -> bool:
        """Whether the ephemeris is far from the chief that navigation goes by."""
        estimate, measurement = observation.estimate, observation.measurement
        if estimate is None or measurement is None:
            return False
        own, told = estimate.chief_state[:3].tolist(), measurement.chief_state[:3].tolist()
        return not dist(own, told) <= NOISE + 0.5 * largest_unmodelled(hypot(*own)) * WINDOW**2
