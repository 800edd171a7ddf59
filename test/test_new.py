"""`formation-gnc new`: scenarios from another one, from element sets and from ephemerides."""

from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from formation_gnc.cli import main
from formation_gnc.errors import ConfigurationError
from formation_gnc.interchange.ephemeris import Ephemeris
from formation_gnc.interchange.oem import read_oem, write_oem
from formation_gnc.interchange.source import to_j2000
from formation_gnc.interchange.starts import departure, read_orbits, start_of
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_from_relative
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.sil.scenario import load_scenario

TLE = """ISS (ZARYA)
1 25544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2927
2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537
"""

EPOCH = 845640069.184
"""s of TT since J2000.0, in 2026."""
START = np.array([6878e3, 0.0, 0.0, 0.0, 3000.0, 6990.0])
RELATIVE = np.array([100.0, -2000.0, 50.0, 0.0, -0.2, 0.1])


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def pair(here: Path) -> list[Path]:
    """OEM of two satellites over an hour under J2, a state a minute."""
    states, times = np.array([START, inertial_from_relative(START, RELATIVE)]), 60.0 * np.arange(61)
    propagator, found = Propagator(60.0), []
    for time in times:
        found.append(states)
        states = propagator.propagate(time, states, np.zeros((2, 3)))
    history = np.array(found)
    paths = [here / "lead.oem", here / "follow.oem"]
    for index, path in enumerate(paths):
        write_oem(Ephemeris(path.stem, EPOCH, times, history[:, index], history[:, index]), path)
    return paths


def test_from_a_scenario_it_is_that_scenario(here):
    assert main(["new", "mine"]) == 0
    mine = load_scenario("mine.yaml")
    assert mine.parameters() == load_scenario("leader_follower").parameters()
    assert "chief.semi_major_axis: 6978100.0" in (here / "mine.yaml").read_text()


def test_from_ephemerides_it_starts_where_they_do(pair):
    assert main(["new", "pair", "--from", *map(str, pair), "--duration", "1 h"]) == 0
    scenario = load_scenario("pair.yaml")
    plant = scenario.plant
    assert (plant.epoch, plant.duration) == (pytest.approx(EPOCH, abs=1e-6), 3600.0)
    # Elements in km and degrees lose some bits: 1e-16 of the radius, more by the angles' conversion.
    np.testing.assert_allclose(state_from_elements(plant.chief_elements), START, rtol=1e-14, atol=1e-6)
    np.testing.assert_allclose(plant.deputy["deputy1"].relative_state, RELATIVE, atol=1e-7)
    guidance = scenario.deputies["deputy1"]["guidance"]
    assert guidance.formation == "slot_list"
    np.testing.assert_allclose(guidance.formation_parameters.states, RELATIVE, atol=1e-7)


def test_states_between_those_of_an_ephemeris_are_interpolated(pair):
    """Eight states a minute apart: below a tenth of a millimetre."""
    orbit = read_orbits(pair)[0]
    exact = Propagator(30.0).propagate(0.0, START[None], np.zeros((1, 3)))[0]
    np.testing.assert_allclose(orbit.state(EPOCH + 30.0)[:3], exact[:3], rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(orbit.state(EPOCH + 30.0)[3:], exact[3:], rtol=0.0, atol=1e-5)


def test_coasting_as_the_source_did_does_not_part_from_it(pair):
    alone, between = departure(read_orbits(pair), EPOCH, 3600.0)
    assert alone < 1e-3  # rounding of states in km
    assert between < 1e-3


def test_an_element_set_agrees_with_its_published_state(here):
    """Vallado's case of satellite 00005 at its epoch (AIAA 2006-6753, appendix), in TEME."""
    (here / "vanguard.tle").write_text(
        "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753\n"
        "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667\n"
    )
    (orbit,) = read_orbits([here / "vanguard.tle"])
    teme = np.array([7022.46529266, -1400.08296755, 0.03995155, 1.893841015, 6.405893759, 4.534807250]) * 1e3
    # SGP4's own constants and the table's last digit: a millimetre or so; the day of the epoch to 1e-8 of a day, 1 ms.
    published = to_j2000(teme, "TEME", orbit.reference)
    np.testing.assert_allclose(orbit.state(orbit.reference)[:3], published[:3], rtol=0.0, atol=10.0)


def test_turning_frames_keeps_lengths_and_the_earths_axis(here):
    state = np.array([7000e3, 1000e3, 3000e3, -1000.0, 7000.0, 500.0])
    for frame in ("GCRF", "TEME", "ITRF"):
        turned = to_j2000(state, frame, EPOCH)
        assert np.linalg.norm(turned[:3]) == pytest.approx(np.linalg.norm(state[:3]), rel=1e-14)
        # Precession of a quarter of a century: 0.15 degrees of the pole.
        assert abs(turned[2] - state[2]) < 0.003 * np.linalg.norm(state[:3])
    assert np.abs(to_j2000(state, "GCRF", EPOCH) - state)[:3].max() < 2.0  # the frames' bias, 23 mas
    resting = to_j2000(np.array([7000e3, 0.0, 0.0, 0.0, 0.0, 0.0]), "ITRF", EPOCH)
    assert np.linalg.norm(resting[3:]) == pytest.approx(7000e3 * 7.292115e-5, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (TLE.replace("2927", "2928"), "line 3: TLE line gives its checksum as 8"),
        (TLE.splitlines()[1], "the last TLE has one line"),
        ("nothing here", "has no TLE"),
        (TLE.splitlines()[1] + "\nsomething\n", "line 2: 'something' is no second line of a TLE"),
        ("", "has no TLE"),
    ],
)
def test_what_is_no_element_set_is_refused(text, reason, here):
    (here / "wrong.tle").write_text(text)
    with pytest.raises(ConfigurationError, match=reason):
        read_orbits([here / "wrong.tle"])


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("EME2000", "MOON_PA", "REF_FRAME MOON_PA: is not allowed; it must be EME2000, GCRF"),
        ("= EARTH", "= MARS", "CENTER_NAME MARS: is not allowed; it must be EARTH"),
        ("= TT", "= MET", "TIME_SYSTEM MET: is not allowed"),
        ("META_STOP", "META_STOP\n2026-10-18T23:59:00 1 2 3 4 5 nan", "it must have six finite numbers"),
        ("META_STOP", "META_STOP\n2027-10-18T23:59:00 1 2 3 4 5 6", "its times must ascend"),
        ("META_STOP", "META_STOP\nyesterday 1 2 3 4 5 6", "'yesterday 1 2 3 4 5 6'"),
        ("META_START", "META_STOP", "has no segment of an OEM"),
    ],
)
def test_a_wrong_ephemeris_is_refused(old, new, reason, pair):
    path = pair[0]
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ConfigurationError, match=reason):
        read_orbits([path])


def test_dates_of_day_of_year_and_time_systems_are_read(pair):
    text = pair[0].read_text()
    tt = read_oem(pair[0], text)[0].first
    tai = read_oem(pair[0], text.replace("= TT", "= TAI"))[0].first
    utc = read_oem(pair[0], text.replace("= TT", "= UTC"))[0].first
    assert (tai - tt, utc - tt) == (pytest.approx(32.184, abs=1e-6), pytest.approx(69.184, abs=1e-5))
    day = text.partition("START_TIME = ")[2][:10]
    by_day = text.replace(day, f"{datetime.fromisoformat(day):%Y-%j}")
    assert read_oem(pair[0], by_day)[0].first == tt


def test_a_name_that_is_taken_and_mixed_sources_are_refused(pair, capsys):
    (pair[0].parent / "mine.yaml").write_text("")
    assert main(["new", "mine"]) == 2
    assert main(["new", "other", "--from", "leader_follower", str(pair[0])]) == 2
    assert main(["new", "other", "--from", str(pair[0]), "--epoch", "2020-01-01"]) == 2
    assert main(["new", "other", "--from", str(pair[0]), "--duration", "-1 h"]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 4
    assert "mine.yaml: exists already" in errors[0]
    assert "must be one scenario, or files of orbits alone" in errors[1]
    assert "its ephemeris does not reach" in errors[2]
    assert "duration '-1 h': is not allowed" in errors[3]
    assert not (pair[0].parent / "other.yaml").exists()


def test_the_epoch_is_the_latest_reference_when_none_is_given(here):
    (here / "one.tle").write_text(TLE)
    orbits = read_orbits([here / "one.tle"])
    start = start_of(orbits, None)
    assert start.epoch == orbits[0].reference
    assert isinstance(start.chief, Elements)
    assert 6.7e6 < start.chief.semi_major_axis < 6.8e6
