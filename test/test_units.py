"""Values with a unit: exact factors, and what is not understood is refused with what is allowed."""

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.common import CommonParameters
from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import load
from formation_gnc.plant.parameters import DeputyParameters
from formation_gnc.units import EPOCH_UNIT, to_si

ORBIT = {"chief.semi_major_axis": "6978.1 km", "chief.inclination": "85 deg", "tick": "1 min"}


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("97.4 deg", "rad", 97.4 * pi / 180.0),
        ("700 km", "m", 700e3),
        ("-3.5e-1 mm/s", "m/s", -0.35e-3),
        ("40 uN", "N", 40e-6),
        ("1.5 h", "s", 5400.0),
        (" 2  kg ", "kg", 2.0),
        ("1 arcsec", "rad", pi / 648000.0),
    ],
)
def test_a_quantity_becomes_si(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-15)


@given(st.floats(-1e12, 1e12))
def test_the_si_unit_itself_changes_nothing(number):
    assert to_si(f"{number!r} m", "m") == number


def test_parameters_take_quantities_and_units_of_each_half_of_a_state():
    common = load(CommonParameters, ORBIT)
    assert (common.chief.semi_major_axis, common.tick) == (6978100.0, 60.0)
    assert common.chief.inclination == pytest.approx(85.0 * pi / 180.0, rel=1e-15)
    state = ["0.01 km", 5.0, "-3 m", "1 cm/s", 0.0, "2 mm/s"]
    deputy = load(DeputyParameters, {"relative_state": state})
    assert deputy.relative_state == pytest.approx((10.0, 5.0, -3.0, 0.01, 0.0, 0.002), rel=1e-15)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"chief.inclination": "85 degrees"}, "'85 degrees': unit 'degrees' is not allowed; it must be rad, deg"),
        ({"chief.semi_major_axis": "6978 s"}, "'6978 s': unit 's' is not allowed; it must be m, km, cm, mm"),
        ({"chief.eccentricity": "0.1 m"}, "unit 'm' is not allowed; it must be a number alone"),
        ({"chief.semi_major_axis": "far"}, "'far' is not allowed; it must be a value of type double"),
        ({"chief.semi_major_axis": "-700 km"}, "-700000.0 is not allowed; it must be above 0"),
        ({"epoch": "2026-13-01"}, "month must be in 1..12; it must be like 2026-11-28T12:00:00Z"),
        ({"epoch": "today"}, "'today' is not allowed"),
    ],
)
def test_what_is_no_quantity_of_the_parameter_is_refused(values, reason):
    with pytest.raises(ConfigurationError, match=f"parameter {next(iter(values))}: .*{reason}".replace("[", r"\[")):
        load(CommonParameters, ORBIT | values)


def test_a_velocity_is_no_length_in_a_state():
    with pytest.raises(ConfigurationError, match="unit 'm/s' is not allowed; it must be m, km"):
        load(DeputyParameters, {"relative_state": ["1 m/s", 0.0, 0.0, 0.0, 0.0, 0.0]})


@pytest.mark.parametrize(
    ("date", "seconds"),
    [
        ("2000-01-01T11:58:55.816Z", 0.0),  # J2000.0 is noon in TT: 32 leap seconds and 32.184 s before in UTC
        ("2000-01-01T12:00:00Z", 64.184),
        ("2000-01-01T14:00:00+02:00", 64.184),
        ("2026-11-28", 9828 * 86400.0 - 43200.0 + 37.0 + 32.184),  # 37 leap seconds since 2017
        ("1999-12-31 12:00:00", -86400.0 + 64.184),
    ],
)
def test_a_date_in_utc_becomes_terrestrial_time(date, seconds):
    assert to_si(date, EPOCH_UNIT) == pytest.approx(seconds, abs=1e-6)
