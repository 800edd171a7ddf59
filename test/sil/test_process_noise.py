"""Process noise that the truth's forces ask of a filter."""

import numpy as np
import pytest

from formation_gnc.sil.process_noise import _density, process_noise_warnings, unmodelled_density
from formation_gnc.sil.scenario import find_scenario, load_scenario


def test_a_truth_with_j2_alone_asks_for_no_process_noise() -> None:
    # the same forces in both, which round differently
    assert unmodelled_density(load_scenario("leader_follower"), "deputy1") < 1e-20


def test_differential_sunlight_asks_for_the_square_of_its_acceleration() -> None:
    """2e-3 m^2/kg times 4.6e-6 N/m^2, shared by the axes of the plane; a radian of the orbit takes 13,700 s."""
    density = unmodelled_density(load_scenario("geostationary"), "deputy1")
    acceleration = (2.0 * 1.4 / 100.0 - 20.0 * 1.3 / 1000.0) * 4.56e-6
    assert density == pytest.approx(acceleration**2 / 2.0 * 13713.0, rel=0.3)


@pytest.mark.parametrize("turns", [0.0, 0.5, 1.0, 3.0, 20.0])
def test_density_is_the_square_times_the_time_in_which_it_changes(turns: float) -> None:
    """A sine's time is one over its rate; one of less than a turn, or a constant, turns with the orbit all the same."""
    rate, points, size = 1.1e-3, 4000, 3e-9
    step = 2.0 * np.pi / rate / points
    wave = size * np.cos(turns * rate * step * np.arange(points))
    expected = np.mean(wave**2) / rate / max(turns, 1.0)
    assert _density(np.outer(wave, [0.1, 1.0, 0.0]), step, 1.0 / rate) == pytest.approx(expected, rel=0.01)


SHIPPED = sorted(path.stem for path in find_scenario("leader_follower").parent.glob("*.yaml"))


@pytest.mark.parametrize("scenario", SHIPPED)
def test_shipped_scenarios_have_the_process_noise_that_they_need(scenario: str) -> None:
    assert process_noise_warnings(load_scenario(scenario)) == []


def test_too_little_process_noise_is_named_with_what_is_needed() -> None:
    scenario = load_scenario("geostationary", {"/**/navigation": {"acceleration_density": 1e-14}})
    (warning,) = process_noise_warnings(scenario)
    assert warning.startswith("/deputy1/navigation: acceleration_density is 1.0e-14 m^2/s^3")
