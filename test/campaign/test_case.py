"""A case is a pure function of its number, with the figures that a bag of it has."""

from dataclasses import asdict

import numpy as np
import pytest

from formation_gnc.analysis.figures import figures
from formation_gnc.campaign.case import drawn_columns, fly_case, scenario_of
from formation_gnc.campaign.definition import find_campaign, load_campaign
from formation_gnc.campaign.flight_figures import NUMBERS, within_name
from formation_gnc.cli import main
from formation_gnc.recording import Bag
from formation_gnc.sil.process_noise import process_noise_warnings
from formation_gnc.sil.runner import Run


def test_case_has_the_same_bits_whatever_was_flown_before(write, small):
    campaign = load_campaign(write(small))
    configuration = campaign.configurations[0]
    forth = [fly_case(campaign, case, configuration) for case in (0, 1)]
    again = [fly_case(load_campaign(write(small)), case, configuration) for case in (1, 0)][::-1]
    for one, other in zip(forth, again, strict=True):
        assert one.row == other.row
        assert all(np.array_equal(one.curves[name], other.curves[name]) for name in one.curves)
    assert forth[0].row["deputy1.final_error_m"] != forth[1].row["deputy1.final_error_m"]


@pytest.mark.usefixtures("without_pictures")
def test_figures_of_a_case_are_those_of_its_bag_bit_for_bit(write, small, tmp_path, capsys):
    path, bag = write(small), tmp_path / "bag"
    assert main(["campaign", str(path), "--only", "3", "--bag", str(bag), "--json"]) == 0
    capsys.readouterr()
    campaign = load_campaign(path)
    row = fly_case(campaign, 3, campaign.configurations[0]).row
    recorded = figures(Bag(bag)).deputies["deputy1"].by_name()
    assert {name: row[f"deputy1.{name}"] for name in NUMBERS} == {name: recorded[name] for name in NUMBERS}
    assert row["deputy1.verdict"] == asdict(figures(Bag(bag)).deputies["deputy1"])["verdict"]


def test_row_has_what_was_drawn_as_it_was_flown(write, small):
    campaign = load_campaign(write(small))
    for case in range(4):
        scenario = scenario_of(campaign, case, campaign.configurations[0])
        columns = drawn_columns(campaign, case, scenario)
        deputy = scenario.plant.deputy["deputy1"]
        assert columns["plant.deputy1.mass"] == deputy.mass
        assert [columns[f"plant.deputy1.relative_state[{axis}]"] for axis in range(6)] == list(deputy.relative_state)
        assert columns["faults.stuck"] == bool(scenario.plant.faults)
        if scenario.plant.faults:
            assert columns["faults.stuck.at"] == scenario.plant.planned_faults[0].fault.at


def test_case_that_raises_is_a_row_with_its_reason(write, small, monkeypatch):
    def fly(self, sink):
        raise ZeroDivisionError("the filter\ndivided")

    campaign = load_campaign(write(small))
    monkeypatch.setattr(Run, "fly", fly)
    flown = fly_case(campaign, 0, campaign.configurations[0])
    assert flown.row["reason"] == "ZeroDivisionError: the filter divided"
    assert flown.row["plant.deputy1.mass"] > 0.0
    assert not flown.curves


def test_time_to_within_a_distance_is_when_the_error_stays_there(write, small):
    campaign = load_campaign(write(small))
    error = np.linalg.norm(fly_case(campaign, 0, campaign.configurations[0]).curves["deputy1"], axis=1)
    distance = round(float(error[20:].max()) + 0.05, 1)  # from some tick up to the twentieth on
    statement = f"- time to within {distance} m < 400 in 60 % at 80 % confidence\n  - final_error_m <"
    campaign = load_campaign(write(small.replace("- final_error_m <", statement)))
    assert distance in campaign.within
    row = fly_case(campaign, 0, campaign.configurations[0]).row
    settled = round(row[f"deputy1.{within_name(distance)}"] / 10.0)
    assert 0 <= settled <= 20
    assert (error[settled:] <= distance).all()
    assert settled == 0 or error[settled - 1] > distance


@pytest.mark.parametrize(("density", "is_enough"), [(None, True), (1e-14, False)], ids=["its own", "the scenario's"])
def test_the_default_campaign_has_the_process_noise_of_its_drag(tmp_path, density, is_enough):
    """Drag differs by up to a fifth between the satellites, of which no filter knows."""
    campaign = load_campaign(find_campaign("leader_follower"))
    if density is not None:
        text = (
            find_campaign("leader_follower")
            .read_text()
            .replace("acceleration_density: 2.6e-13", f"acceleration_density: {density}")
        )
        (tmp_path / "own.yaml").write_text(text)
        campaign = load_campaign(tmp_path / "own.yaml")
    scenarios = [scenario_of(campaign, case, campaign.configurations[0]) for case in range(20)]
    assert (not any(map(process_noise_warnings, scenarios))) == is_enough
