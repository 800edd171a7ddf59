from collections.abc import Callable

import numpy as np
import pytest

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Vehicle
from formation_gnc.records import NO_ECLIPSES, NO_NEIGHBOURS, NavigationState, Target
from formation_gnc.types import NANOSECONDS, Matrix, Vector


@pytest.fixture(scope="session")
def common() -> CommonParameters:
    """MUSTANG's orbit (Roberts), 10 s ticks."""
    return CommonParameters(Orbit(6978100.0, inclination=1.4835298641951802), tick=10.0)


@pytest.fixture(scope="session")
def vehicle() -> Vehicle:
    """Roberts' follower: 100 kg, 10 mN."""
    return Vehicle(100.0, np.full(3, 0.01))


@pytest.fixture(scope="session")
def estimate() -> Callable[..., NavigationState]:
    """Builder of the estimate of a relative state at a time (s)."""

    def build(state: Vector, time: float = 0.0, mass: float = 100.0, chief: Vector | None = None) -> NavigationState:
        return NavigationState(
            time=round(time * NANOSECONDS),
            relative_state=np.asarray(state, dtype=float),
            chief_state=np.zeros(6) if chief is None else chief,
            mass=mass,
        )

    return build


@pytest.fixture(scope="session")
def target() -> Callable[..., Target]:
    """Builder of a target at a time (s), optionally with preview, eclipses (s) and neighbours."""

    def build(
        state: Vector | None = None,
        time: float = 0.0,
        preview: Vector | None = None,
        step: float = 60.0,
        eclipses: Matrix = NO_ECLIPSES,
        neighbours: Matrix = NO_NEIGHBOURS,
    ) -> Target:
        return Target(
            round(time * NANOSECONDS),
            "leader_follower",
            np.zeros(6) if state is None else np.asarray(state, dtype=float),
            round(step * NANOSECONDS),
            np.empty((0, 6)) if preview is None else preview,
            np.rint(eclipses * NANOSECONDS).astype(np.int64),
            neighbours,
        )

    return build
