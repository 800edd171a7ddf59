"""Dispersions are applied, or the campaign does not fly."""

import pyarrow as pa
import pytest

from formation_gnc.campaign import case
from formation_gnc.campaign.application import check_application
from formation_gnc.campaign.dataset import Dataset
from formation_gnc.campaign.definition import load_campaign
from formation_gnc.campaign.evaluation import Flights, NotAppliedError
from formation_gnc.errors import ConfigurationError

HEAD = "scenario: leader_follower\nruns: 4\nset: {plant.tick: 10.0, plant.duration: 200.0}\n"


def check(path):
    check_application(load_campaign(path), lambda _: None)


def test_dispersions_and_faults_that_change_the_flight_pass(write, small):
    said = []
    check_application(load_campaign(write(small)), said.append)
    assert [each.split()[-1] for each in said] == ["plant.deputy1.relative_state", "plant.deputy1.mass", "stuck"]


@pytest.mark.parametrize(
    "spec",
    [
        "controller.mpc.thrust: {uniform: {low: 0.001, high: 0.002}}",  # of a law that does not fly
        "plant.deputy1.drag_coefficient: {uniform: {low: 1.0, high: 2.0}}",  # without drag
    ],
)
def test_dispersion_of_what_nobody_uses_is_refused(write, spec):
    with pytest.raises(ConfigurationError, match="changes nothing; flights that differ in it alone"):
        check(write(HEAD + f"dispersions: {{{spec}}}"))


def test_dispersion_that_one_variant_uses_passes(write):
    spec = "dispersions: {controller.mpc.thrust: {uniform: {low: 0.001, high: 0.002}}}\n"
    check(write(HEAD + spec + "variants: {lqr: {controller.algorithm: lqr}, mpc: {controller.algorithm: mpc}}"))


def test_dispersion_that_is_lost_on_the_way_is_refused(write, small, monkeypatch):
    campaign = load_campaign(write(small))
    resolve = case.with_values

    def lossy(campaign, configuration, drawn, faults, seed):
        return resolve(campaign, configuration, {**drawn, "plant.deputy1.mass": {}}, faults, seed)

    monkeypatch.setattr("formation_gnc.campaign.application.with_values", lossy)
    with pytest.raises(ConfigurationError, match=r"dispersion plant.deputy1.mass: changes nothing; .* same parameters"):
        check_application(campaign, lambda _: None)


def test_choice_that_draws_the_same_in_all_cases_is_refused(write):
    spec = "dispersions: {plant.deputy1.mass: {choice: {of: [100.0, 90.0], weights: [1.0e9, 1.0]}}}"
    with pytest.raises(ConfigurationError, match="draws the same in all of 4 cases"):
        check(write(HEAD + spec))


def test_variants_of_the_same_parameters_are_refused(write):
    with pytest.raises(ConfigurationError, match="b: flies the same as a"):
        check(write(HEAD + "variants: {a: {controller.algorithm: lqr}, b: {plant.deputy1.mass: 100.0}}"))


def test_constant_column_of_a_dispersion_is_an_error(write, small, tmp_path):
    campaign = load_campaign(write(small))
    results = Dataset(tmp_path / "results")
    results.create(campaign, "1", "c", 4)
    rows = [
        {
            "case": number,
            "variant": "nominal",
            "reason": "",
            "plant.deputy1.mass": 100.0,
            "plant.deputy1.relative_state[0]": float(number),
            "faults.stuck": number == 1,
        }
        for number in range(4)
    ]
    results.write((0, 4), rows, [], [])
    assert isinstance(results.table(["plant.deputy1.mass"]), pa.Table)
    with pytest.raises(NotAppliedError, match=r"plant.deputy1.mass: has the same value in all 4 flights"):
        Flights(campaign, results).check_drawn()
