"""Basilisk's two formation laws flown by Basilisk itself: `spacecraftReconfig` and `meanOEFeedback`.

The cases are those of its examples scenarioFormationReconfig and scenarioFormationMeanOEFeedback.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from Basilisk.architecture import messaging
from Basilisk.fswAlgorithms import attTrackingError, meanOEFeedback, mrpFeedback, spacecraftReconfig
from Basilisk.simulation import extForceTorque, simpleNav, spacecraft, thrusterDynamicEffector
from Basilisk.utilities import SimulationBaseClass, fswSetupThrusters, macros, simIncludeThruster
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.forces.model import Forces
from verification.independent import basilisk_earth

Array = NDArray[np.float64]

MASS = 500.0
"""kg"""
INERTIA = [900.0, 0.0, 0.0, 0.0, 800.0, 0.0, 0.0, 0.0, 600.0]
"""kg m^2"""


@dataclass(frozen=True)
class Flown:
    """States of chief and deputy at the end, and what the deputy spent."""

    chief: Array
    """(6,) inertial, m and m/s."""
    deputy: Array
    """(6,)"""
    delta_v: float
    """Integral of the magnitude of the thrust acceleration, m/s."""
    largest: float
    """Largest thrust, N."""


class _Simulation:
    """Two spacecraft with navigation that knows the truth."""

    def __init__(self, states: Array, zonal_degree: int, step: float) -> None:
        self.simulation = SimulationBaseClass.SimBaseClass()
        self.simulation.SetProgressBar(False)
        process = self.simulation.CreateNewProcess("process", 10)
        process.addTask(self.simulation.CreateNewTask("task", macros.sec2nano(step)))
        self.craft, self.navigation, self.kept = [], [], list[Any]()
        for index, state in enumerate(states):
            craft, navigation = spacecraft.Spacecraft(), simpleNav.SimpleNav()
            craft.ModelTag = f"craft{index}"
            craft.hub.mHub = MASS
            craft.hub.r_BcB_B = [[0.0]] * 3
            craft.hub.IHubPntBc_B = np.reshape(INERTIA, (3, 3)).tolist()
            craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = state[:3].tolist(), state[3:].tolist()
            craft.hub.sigma_BNInit = craft.hub.omega_BN_BInit = [[0.0]] * 3
            earth = basilisk_earth(Forces(zonal_degree=zonal_degree))
            craft.gravField.gravBodies = spacecraft.GravBodyVector([earth])
            navigation.scStateInMsg.subscribeTo(craft.scStateOutMsg)
            self.add(craft, 20)
            self.add(navigation, 15)
            self.craft.append(craft)
            self.navigation.append(navigation)
            self.kept.append(earth)

    def add(self, model: Any, priority: int) -> Any:
        """Add a model to the task."""
        self.simulation.AddModelToTask("task", model, priority)
        self.kept.append(model)
        return model

    def fly(self, duration: float) -> Flown:
        """To the end."""
        records = [each.scStateOutMsg.recorder() for each in self.craft]
        for each in records:
            self.add(each, -10)
        self.simulation.InitializeSimulation()
        self.simulation.ConfigureStopTime(macros.sec2nano(duration))
        self.simulation.ExecuteSimulation()
        spent = np.linalg.norm(np.diff(np.array(records[1].TotalAccumDV_CN_N), axis=0), axis=1)
        ends = [np.concatenate([each.r_CN_N[-1], each.v_CN_N[-1]]) for each in records]
        step = np.diff(records[1].times()[:2])[0] * macros.NANO2SEC
        return Flown(*ends, float(spent.sum()), MASS * float(spent.max()) / step)


def reconfigured(states: Array, target: list[float], duration: float) -> Flown:
    """`spacecraftReconfig` in point-mass gravity: states (2, 6), differences of the classical elements to reach."""
    own = _Simulation(states, 0, 2.0)
    deputy, navigation = own.craft[1], own.navigation[1]
    effector, factory = thrusterDynamicEffector.ThrusterDynamicEffector(), simIncludeThruster.thrusterFactory()
    for _ in range(2):
        factory.create("MOOG_Monarc_22_6", [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], useMinPulseTime=False)
    factory.addToSpacecraft("thrusters", effector, deputy)
    torque = extForceTorque.ExtForceTorque()
    deputy.addDynamicEffector(torque)
    fswSetupThrusters.clearSetup()
    for thruster in factory.thrusterList.values():
        place, direction = (np.ravel(each).tolist() for each in (thruster.thrLoc_B, thruster.thrDir_B))
        fswSetupThrusters.create(place, direction, thruster.MaxThrust)
    configured = fswSetupThrusters.writeConfigMessage()
    vehicle = messaging.VehicleConfigMsg().write(messaging.VehicleConfigMsgPayload(massSC=MASS, ISCPntB_B=INERTIA))
    law = spacecraftReconfig.spacecraftReconfig()
    law.chiefTransInMsg.subscribeTo(own.navigation[0].transOutMsg)
    law.deputyTransInMsg.subscribeTo(navigation.transOutMsg)
    law.thrustConfigInMsg.subscribeTo(configured)
    law.vehicleConfigInMsg.subscribeTo(vehicle)
    law.mu, law.attControlTime, law.targetClassicOED = MU, 400.0, target
    effector.cmdsInMsg.subscribeTo(law.onTimeOutMsg)
    error, feedback = attTrackingError.attTrackingError(), mrpFeedback.mrpFeedback()
    error.attRefInMsg.subscribeTo(law.attRefOutMsg)
    error.attNavInMsg.subscribeTo(navigation.attOutMsg)
    feedback.guidInMsg.subscribeTo(error.attGuidOutMsg)
    feedback.vehConfigInMsg.subscribeTo(vehicle)
    feedback.K, feedback.Ki, feedback.P = 10.0, 0.0002, 50.0
    feedback.integralLimit = 2.0 / feedback.Ki * 0.1
    torque.cmdTorqueInMsg.subscribeTo(feedback.cmdTorqueOutMsg)
    for model, priority in ((law, 10), (error, 9), (feedback, 8), (effector, 30), (torque, 29)):
        own.add(model, priority)
    own.kept += [configured, vehicle, factory]
    return own.fly(duration)


def fed_back(states: Array, target: list[float], duration: float, step: float) -> Flown:
    """`meanOEFeedback` of classical elements under J2: as `reconfigured`, with a time (s) between its forces."""
    own = _Simulation(states, 2, step)
    push = extForceTorque.ExtForceTorque()
    own.craft[1].addDynamicEffector(push)
    law = meanOEFeedback.meanOEFeedback()
    law.chiefTransInMsg.subscribeTo(own.navigation[0].transOutMsg)
    law.deputyTransInMsg.subscribeTo(own.navigation[1].transOutMsg)
    law.K, law.targetDiffOeMean, law.oeType = (1e7 * np.eye(6)).ravel().tolist(), target, 0
    law.mu, law.req, law.J2 = MU, EARTH_RADIUS, J2
    push.cmdForceInertialInMsg.subscribeTo(law.forceOutMsg)
    own.add(law, 10)
    own.add(push, 29)
    return own.fly(duration)
