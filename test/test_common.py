import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.errors import ConfigurationError


@given(st.integers(1, 10**12))
def test_a_tick_of_whole_nanoseconds_is_exact(nanoseconds: int) -> None:
    assert CommonParameters(Orbit(7e6), nanoseconds * 1e-9).tick_ns == nanoseconds


@pytest.mark.parametrize("tick", [1.0 / 3.0, 1.5e-9, 1e-10])
def test_a_tick_of_fractional_nanoseconds_is_rejected(tick: float) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        CommonParameters(Orbit(7e6), tick)
    assert str(rejection.value) == (
        f"parameter tick: {tick!r} is not allowed; it must be a whole number of nanoseconds"
    )


def test_geostationary_mean_motion_is_one_turn_per_sidereal_day() -> None:
    # 42164.17 km is printed to 5 m, which is 2e-7 of a period
    period = 2.0 * math.pi / CommonParameters(Orbit(42_164_172.0)).mean_motion
    assert period == pytest.approx(86_164.1, rel=5e-7)
