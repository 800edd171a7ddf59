"""Hill's equations at the mean rates that J2 gives a near-circular chief."""

from dataclasses import dataclass
from functools import cache

from formation_gnc.orbit.elements import Elements
from formation_gnc.orbit.mean import mean_elements, secular_rates
from formation_gnc.relative.hill import HarmonicModel


@dataclass(frozen=True)
class J2MeanMotionModel(HarmonicModel):
    """Linear relative motion at the chief's secular rates under J2, time-invariant and of Hill's form.

    The Hill frame turns, and the nodes come round, at the rate of the mean argument of latitude; the in-plane
    ellipse comes round at that of the mean anomaly, since the perigee turns. The rates are those of the mean
    elements: the osculating semi-major axis gives the mean motion to a part in a thousand only.

    Assumes: near-circular chief, separation much smaller than the radius.
    """

    has_j2 = True

    latitude_rate: float
    """Of the mean argument of latitude, rad/s."""
    anomaly_rate: float
    """Of the mean anomaly, rad/s."""

    @classmethod
    @cache  # slot assignment builds hundreds of paths about one chief
    def about(cls, chief: Elements) -> "J2MeanMotionModel":
        """At the secular rates of the chief's mean elements."""
        _, perigee, anomaly = secular_rates(mean_elements(chief))
        return cls(perigee + anomaly, anomaly)

    @property
    def frequencies(self) -> tuple[float, float, float]:
        """Frame's rate, in-plane and cross-track frequency, rad/s."""
        return self.latitude_rate, self.anomaly_rate, self.latitude_rate
