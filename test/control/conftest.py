from collections.abc import Callable

import numpy as np
import pytest

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Vehicle
from formation_gnc.records import NavigationState, Target
from formation_gnc.testing.laws import estimate_of, target_of


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
    return estimate_of


@pytest.fixture(scope="session")
def target() -> Callable[..., Target]:
    """Builder of a target at a time (s), optionally with preview, eclipses (s) and neighbours."""
    return target_of
