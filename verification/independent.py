"""The same orbits flown by heyoka and by Basilisk: this project's constants and tables, none of its dynamics.

heyoka integrates symbolic right-hand sides by Taylor series to extended precision. Basilisk flies its own
spacecraft, gravity, radiation and drag modules; where Sun, Moon and the Earth's rotation are wanted, they
reach it as messages, from this project's series or from JPL's ephemeris.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, sin
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import heyoka
import numpy as np
from Basilisk.architecture import astroConstants, messaging, sysModel
from Basilisk.simulation import (
    dragDynamicEffector,
    eclipse,
    exponentialAtmosphere,
    gravityEffector,
    radiationPressure,
    spacecraft,
    svIntegrators,
    zeroWindModel,
)
from Basilisk.utilities import SimulationBaseClass, macros
from jplephem.spk import SPK
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, EARTH_ROTATION_RATE, MU, NORMALISED_ZONALS
from formation_gnc.orbit.forces.egm2008 import NORMALISED_C, NORMALISED_S
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.forces.radiation import SOLAR_PRESSURE
from formation_gnc.orbit.forces.third_body import MU_MOON, MU_SUN
from formation_gnc.orbit.sky import earth_rotation_angle, moon, sun

Array = NDArray[np.float64]

Places = Callable[[float], tuple[Array, Array]]
"""Positions of Sun and Moon, m, at a time in s of TT since J2000.0."""


def series(time: float) -> tuple[Array, Array]:
    """Sun and Moon as the truth sees them."""
    return np.array(sun(time)), np.array(moon(time))


def jpl() -> Places:
    """Sun and Moon of JPL's DE421, from the package skyfield-data."""
    import skyfield_data

    kernel = SPK.open(Path(skyfield_data.__file__).parent / "data" / "de421.bsp")

    def places(time: float) -> tuple[Array, Array]:
        day, fraction = 2451545.0, time / 86400.0
        earth = kernel[3, 399].compute(day, fraction)[:3]
        to_sun = kernel[0, 10].compute(day, fraction)[:3] - kernel[0, 3].compute(day, fraction)[:3] - earth
        return to_sun * 1e3, (kernel[3, 301].compute(day, fraction)[:3] - earth) * 1e3

    return places


class Heyoka:
    """Point mass with zonal harmonics, or with EGM2008 as heyoka itself has it, turning with the Earth."""

    def __init__(self, forces: Forces, epoch: float, precision: type = np.longdouble) -> None:
        """Compile the equations of motion; in extended precision by default."""
        position = heyoka.make_vars("x", "y", "z")
        velocity = heyoka.make_vars("vx", "vy", "vz")
        if forces.harmonics_degree >= 2:
            gravity = self._turning(position, forces.harmonics_degree, epoch)
        else:
            gravity = self._zonal(position, forces.zonal_degree)
        self._precision = precision
        self._integrator = heyoka.taylor_adaptive(
            list(zip([*position, *velocity], [*velocity, *gravity], strict=True)),
            [precision(value) for value in (7e6, 0.0, 0.0, 0.0, 7.5e3, 0.0)],
            fp_type=precision,
            high_accuracy=True,
            compact_mode=True,
        )

    @staticmethod
    def _zonal(position: Any, degree: int) -> list[Any]:
        x, y, z = position
        r = heyoka.sqrt(x * x + y * y + z * z)
        s = z / r
        legendre = [1.0, s]
        for n in range(1, degree):
            legendre.append(((2.0 * n + 1.0) * s * legendre[n] - float(n) * legendre[n - 1]) / (n + 1.0))
        potential = MU / r
        for n in range(2, degree + 1):
            scale = MU * NORMALISED_ZONALS[n] * np.sqrt(2 * n + 1) * EARTH_RADIUS**n
            potential = potential + scale * legendre[n] / r ** (n + 1.0)
        return [heyoka.diff(potential, variable) for variable in (x, y, z)]

    @staticmethod
    def _turning(position: Any, degree: int, epoch: float) -> list[Any]:
        x, y, z = position
        rate = (earth_rotation_angle(1000.0) - earth_rotation_angle(0.0)) / 1000.0
        angle = earth_rotation_angle(epoch) + rate * heyoka.time
        c, s = heyoka.cos(angle), heyoka.sin(angle)
        fixed = [c * x + s * y, c * y - s * x, z]
        ax, ay, az = heyoka.model.egm2008_acc(fixed, degree, degree, MU, EARTH_RADIUS)
        return [c * ax - s * ay, s * ax + c * ay, az]

    def fly(self, state: Array, duration: float) -> Array:
        """State after a duration, s, from time zero."""
        self._integrator.time = self._precision(0.0)
        self._integrator.state[:] = state
        self._integrator.propagate_until(self._precision(duration))
        return np.array(self._integrator.state, dtype=np.float64)

    def fly_in_ticks(self, state: Array, duration: float, tick: float) -> Array:
        """The same, stopped at every tick, s, as a thrust that changes there would need."""
        self._integrator.time = self._precision(0.0)
        self._integrator.state[:] = state
        for k in range(1, round(duration / tick) + 1):
            self._integrator.propagate_until(self._precision(k * tick))
        return np.array(self._integrator.state, dtype=np.float64)


class _Sky(sysModel.SysModel):
    """Basilisk module that says where Sun and Moon are and how the Earth is turned."""

    def __init__(self, epoch: float, places: Places, step: float) -> None:
        super().__init__()
        self.ModelTag = "sky"
        self._epoch, self._places, self._step = epoch, places, step
        self.earth, self.sun, self.moon = (messaging.SpicePlanetStateMsg() for _ in range(3))

    def Reset(self, now: int) -> None:
        self.UpdateState(now)

    def UpdateState(self, now: int) -> None:
        """Write the messages of this instant."""
        time = self._epoch + now * 1e-9
        before, here, after = self._places(time - 1.0), self._places(time), self._places(time + 1.0)
        for name, message, index in (("sun", self.sun, 0), ("moon", self.moon, 1)):
            payload = messaging.SpicePlanetStateMsgPayload()
            payload.PlanetName = name
            payload.PositionVector = here[index]
            payload.VelocityVector = (after[index] - before[index]) / 2.0
            payload.J20002Pfix = np.eye(3)
            message.write(payload, now, self.moduleID)
        # Basilisk extrapolates a rotating frame as a matrix plus its rate, which stretches it by (w dt)^2/2,
        # and gravity with it: 1 m a day at steps of 1 s. So it gets the orientation in mid-step, and no rate.
        angle = earth_rotation_angle(time - 0.5 * self._step)
        c, s = cos(angle), sin(angle)
        payload = messaging.SpicePlanetStateMsgPayload()
        payload.PlanetName = "earth"
        payload.J20002Pfix = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
        payload.J20002Pfix_dot = np.zeros((3, 3))
        payload.computeOrient = 1
        self.earth.write(payload, now, self.moduleID)


def basilisk_earth(forces: Forces) -> Any:
    """The Earth as Basilisk's spacecraft feel it, with this project's constants and harmonics."""
    earth = gravityEffector.GravBodyData()
    earth.planetName = "earth"
    earth.mu, earth.radEquator, earth.isCentralBody = MU, EARTH_RADIUS, True
    degree = forces.harmonics_degree or forces.zonal_degree
    if degree >= 2:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "field.txt"
            rows = [f"{EARTH_RADIUS!r},{MU!r},0,{degree},{degree},1,0,0"]
            for n in range(degree + 1):
                for m in range(n + 1):
                    keep = m == 0 or forces.harmonics_degree >= 2
                    c, s = (NORMALISED_C[n, m], NORMALISED_S[n, m]) if keep else (0.0, 0.0)
                    rows.append(f"{n},{m},{float(c)!r},{float(s)!r},0,0")
            path.write_text("\n".join(rows) + "\n")
            earth.useSphericalHarmonicsGravityModel(str(path), degree)
    else:
        earth.usePointMassGravityModel()
    return earth


@dataclass
class Basilisk:
    """A Basilisk simulation of spacecraft under the given forces.

    `band` is base density (kg/m^3), scale height (m) and base altitude (m) of its one-band atmosphere;
    `still_sky` sends the places of Sun, Moon and Earth once, so that no Python runs in the loop.
    """

    forces: Forces
    epoch: float
    states: Array
    step: float
    body: Body = field(default_factory=Body)
    places: Places = series
    band: tuple[float, float, float] = (3.725e-12, 58.515e3, 400e3)
    precise: bool = True
    still_sky: bool = False

    def __post_init__(self) -> None:
        """Build and initialise the simulation."""
        self._simulation = SimulationBaseClass.SimBaseClass()
        self._simulation.SetProgressBar(False)
        process = self._simulation.CreateNewProcess("dynamics")
        process.addTask(self._simulation.CreateNewTask("task", macros.sec2nano(self.step)))
        self._kept: list[Any] = []
        forces = self.forces
        self._sky = None
        if forces.sun or forces.moon or forces.radiation_pressure or forces.drag or forces.harmonics_degree:
            self._sky = _Sky(self.epoch, self.places, self.step)
            if self.still_sky:
                self._sky.UpdateState(0)
            else:
                self._simulation.AddModelToTask("task", self._sky, 1000)
        self._craft = [self._spacecraft(index, state) for index, state in enumerate(self.states)]
        self._simulation.InitializeSimulation()

    def _spacecraft(self, index: int, state: Array) -> Any:
        forces, body = self.forces, self.body
        craft = spacecraft.Spacecraft()
        craft.ModelTag = f"craft{index}"
        craft.hub.mHub = body.mass
        craft.hub.IHubPntBc_B = [[10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]]
        craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = state[:3], state[3:]
        bodies = [basilisk_earth(self.forces)]
        if self._sky is not None:
            bodies[0].planetBodyInMsg.subscribeTo(self._sky.earth)
        for wanted, mu, name in ((forces.sun, MU_SUN, "sun"), (forces.moon, MU_MOON, "moon")):
            if wanted:
                other = gravityEffector.GravBodyData()
                other.planetName, other.mu = name, mu
                other.usePointMassGravityModel()
                other.planetBodyInMsg.subscribeTo(getattr(self._sky, name))
                bodies.append(other)
        craft.gravField.gravBodies = spacecraft.GravBodyVector(bodies)
        self._simulation.AddModelToTask("task", craft, 10)
        if forces.radiation_pressure:
            self._sunlight(craft)
        if forces.drag:
            self._air(craft)
        if self.precise:
            integrator = svIntegrators.svIntegratorRKF78(craft)
            integrator.relTol, integrator.absTol = 1e-14, 1e-9
            craft.setIntegrator(integrator)
            self._kept.append(integrator)
        self._kept.append(bodies)
        return craft

    def _sunlight(self, craft: Any) -> None:
        shadow = eclipse.Eclipse()
        shadow.addSpacecraftToModel(craft.scStateOutMsg)
        shadow.addPlanetToModel(self._sky.earth)
        shadow.sunInMsg.subscribeTo(self._sky.sun)
        light = radiationPressure.RadiationPressure()
        light.setUseCannonballModel()
        # Its solar constant may be another: the force per area is made the same.
        light.area = self.body.area * SOLAR_PRESSURE / (astroConstants.SOLAR_FLUX_EARTH / astroConstants.SPEED_LIGHT)
        light.coefficientReflection = self.body.reflectivity
        light.sunEphmInMsg.subscribeTo(self._sky.sun)
        light.sunEclipseInMsg.subscribeTo(shadow.eclipseOutMsgs[0])
        craft.addDynamicEffector(light)
        self._simulation.AddModelToTask("task", shadow, 100)
        self._simulation.AddModelToTask("task", light, 90)
        self._kept += [shadow, light]

    def _air(self, craft: Any) -> None:
        density, scale, base = self.band
        air = exponentialAtmosphere.ExponentialAtmosphere()
        air.baseDensity, air.scaleHeight = density, scale
        air.planetRadius = EARTH_RADIUS + base
        air.addSpacecraftToModel(craft.scStateOutMsg)
        air.planetPosInMsg.subscribeTo(self._sky.earth)
        wind = zeroWindModel.ZeroWindModel()
        wind.planetPosInMsg.subscribeTo(self._sky.earth)
        wind.addSpacecraftToModel(craft.scStateOutMsg)
        wind.setPlanetOmega_N([0.0, 0.0, EARTH_ROTATION_RATE])
        brake = dragDynamicEffector.DragDynamicEffector()
        brake.coreParams.projectedArea = self.body.area
        brake.coreParams.dragCoeff = self.body.drag_coefficient
        brake.atmoDensInMsg.subscribeTo(air.envOutMsgs[0])
        brake.windVelInMsg.subscribeTo(wind.envOutMsgs[0])
        craft.addDynamicEffector(brake)
        for priority, module in ((100, air), (99, wind), (90, brake)):
            self._simulation.AddModelToTask("task", module, priority)
        self._kept += [air, wind, brake]

    def fly(self, duration: float) -> Array:
        """States after a duration, s, from time zero."""
        self._simulation.ConfigureStopTime(macros.sec2nano(duration))
        self._simulation.ExecuteSimulation()
        messages = [craft.scStateOutMsg.read() for craft in self._craft]
        return np.array([np.concatenate((message.r_BN_N, message.v_BN_N)) for message in messages])
