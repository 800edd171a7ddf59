"""All faults by name: a new fault is one class and one line here."""

from typing import Any

from formation_gnc.plant.faults import avionics, sensors, thrusters
from formation_gnc.plant.faults.fault import Fault

FAULTS: dict[str, type[Fault[Any]]] = {
    "bias": sensors.Bias,
    "drift": sensors.Drift,
    "freeze": sensors.Freeze,
    "scale": sensors.Scale,
    "dropout": sensors.Dropout,
    "noise": sensors.Noise,
    "outliers": sensors.Outliers,
    "swap": sensors.Swap,
    "late": sensors.Late,
    "stuck_on": thrusters.StuckOn,
    "stuck_off": thrusters.StuckOff,
    "thrust_scale": thrusters.ThrustScale,
    "misalignment": thrusters.Misalignment,
    "leak": thrusters.Leak,
    "slow": thrusters.Slow,
    "mass_scale": avionics.MassScale,
    "force_freeze": avionics.ForceFreeze,
    "force_zero": avionics.ForceZero,
    "chief_freeze": avionics.ChiefFreeze,
    "chief_drift": avionics.ChiefDrift,
    "chief_jump": avionics.ChiefJump,
}
