"""The faults that are flown, each with whom it should be traced to."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.types import Vector


@dataclass(frozen=True)
class Fault:
    """A fault and what is to be named."""

    words: str
    fields: str = ""
    """Of the plant's fault; empty for one of the estimate."""
    subjects: tuple[str, ...] = ("",)
    """Whom to accuse: any of these."""
    offset: Vector | None = None
    """Of the estimated position, m."""
    frozen: bool = False
    """Whether the estimate is."""


EVERY = "radius", "range_rate", "latitude"
AXES = "x", "y", "z"

FAULTS = (
    Fault("radius frozen", "fault: freeze, sensor: radius", ("radius",)),
    Fault("range rate frozen", "fault: freeze, sensor: range_rate", ("range_rate",)),
    Fault("latitude frozen", "fault: freeze, sensor: latitude", ("latitude",)),
    Fault("radius dead", "fault: dropout, sensor: radius", ("radius",)),
    Fault("range rate dead", "fault: dropout, sensor: range_rate", ("range_rate",)),
    Fault("latitude dead", "fault: dropout, sensor: latitude", ("latitude",)),
    Fault("radius biased by 20 m", "fault: bias, sensor: radius, value: 20.0", ("radius",)),
    Fault("radius biased by 100 m", "fault: bias, sensor: radius, value: 100.0", ("radius",)),
    Fault("radius drifting by 1 cm/s", "fault: drift, sensor: radius, rate: 0.01", ("radius",)),
    Fault("radius drifting by 10 cm/s", "fault: drift, sensor: radius, rate: 0.1", ("radius",)),
    Fault("range rate biased by 5 cm/s", "fault: bias, sensor: range_rate, value: 0.05", ("range_rate",)),
    Fault("latitude drifting by 1e-8 rad/s", "fault: drift, sensor: latitude, rate: 1.0e-8", ("latitude",)),
    Fault("latitude biased by 1e-5 rad", "fault: bias, sensor: latitude, value: 1.0e-5", ("latitude",)),
    Fault("radius scaled by 1.00001", "fault: scale, sensor: radius, factor: 1.00001", ("radius",)),
    Fault("radius with five times the noise", "fault: noise, sensor: radius, factor: 5.0", ("", "radius")),
    Fault("a fifth of the radii outliers", "fault: outliers, sensor: radius, share: 0.2", ("", "radius")),
    Fault("radius and latitude swapped", "fault: swap, sensor: radius, other: latitude", ("radius", "latitude")),
    Fault("range rate 20 s late, untold", "fault: late, sensor: range_rate, delay: 20.0, told: false", ("range_rate",)),
    Fault("chief's ephemeris frozen", "fault: chief_freeze", ("chief",)),
    Fault("chief's ephemeris drifting by 5 cm/s", "fault: chief_drift, rate: [0.0, 0.05, 0.0]", ("chief",)),
    Fault("chief's ephemeris drifting by 1 m/s", "fault: chief_drift, rate: [0.0, 1.0, 0.0]", ("chief",)),
    Fault("chief's ephemeris off by 100 m", "fault: chief_jump, offset: [0.0, 100.0, 0.0]", ("chief",)),
    Fault("mass told tenfold", "fault: mass_scale, factor: 10.0"),
    Fault("mass told as a hundredth", "fault: mass_scale, factor: 0.01"),
    Fault("y stuck on, told", "fault: stuck_on, axes: [false, true, false], force: [0.0, {limit}, 0.0]", ("y",)),
    Fault(
        "y stuck on, untold",
        "fault: stuck_on, axes: [false, true, false], force: [0.0, {limit}, 0.0], told: false",
        ("y",),
    ),
    Fault("x stuck off", "fault: stuck_off, axes: [true, false, false]", ("x",)),
    Fault("y stuck off", "fault: stuck_off, axes: [false, true, false]", ("y",)),
    Fault("all thrust halved, told", "fault: thrust_scale, factor: [0.5, 0.5, 0.5]", AXES),
    Fault("thrust reversed, told", "fault: thrust_scale, factor: [-1.0, -1.0, -1.0]", AXES),
    Fault("thrust reversed, untold", "fault: thrust_scale, factor: [-1.0, -1.0, -1.0], told: false", AXES),
    Fault("leak of a twentieth of the limit, untold", "fault: leak, force: [0.0, {leak}, 0.0], told: false", ("y",)),
    Fault("force told frozen", "fault: force_freeze", AXES),
    Fault("force told as none", "fault: force_zero", AXES),
    Fault("estimate off by 100 m along the track", offset=np.array([0.0, 100.0, 0.0])),
    Fault("estimate off by 1 km along the track", offset=np.array([0.0, 1000.0, 0.0])),
    Fault("estimate frozen", frozen=True),
)
