"""A campaign's file: what it says, what it draws, and what is refused in one line."""

import pytest

from formation_gnc.campaign.case import check_dispersions, draw, nominal_scenario, scenario_of, seed_of
from formation_gnc.campaign.dataset import Dataset
from formation_gnc.campaign.definition import find_campaign, load_campaign
from formation_gnc.errors import ConfigurationError

HEAD = "scenario: leader_follower\nset: {plant.tick: 10.0, plant.duration: 600.0}\n"
STATE = "plant.deputy1.relative_state"


def load_and_check(path):
    campaign = load_campaign(path)
    check_dispersions(campaign, campaign.configurations[0])


def refusal(path):
    """Words of the refusal of a campaign, when it is loaded or when its dispersions are checked."""
    with pytest.raises(ConfigurationError) as error:
        load_and_check(path)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("scenario: nowhere", "scenario nowhere: unknown"),
        ("runs: 3", "is no campaign"),
        (HEAD + "run: 3", "run: unknown; did you mean runs?"),
        (HEAD + "runs: 0", "runs: 0 is not allowed; it must be a whole number of at least 1"),
        (HEAD + "seed: -1", "seed: -1 is not allowed"),
        (HEAD + "runs: 3\nruns: 4", "runs is given twice"),
        (HEAD + "dispersions: 3", "dispersions: 3 is not allowed"),
        (
            HEAD + "dispersions: {plnt.seed: {uniform: {low: 0.0, high: 1.0}}}",
            "node plnt is unknown; did you mean plant?",
        ),
        (HEAD + "dispersions: {plant.deputy1.mas: {uniform: {low: 1.0, high: 2.0}}}", "unknown parameter deputy1.mas"),
        (HEAD + "dispersions: {deputy7/guidance.formation: {choice: {of: [a, b]}}}", "no such node"),
        (HEAD + "dispersions: {plant.deputy1.mass: {gauss: {low: 1.0, high: 2.0}}}", "distribution gauss: unknown"),
        (HEAD + "dispersions: {plant.deputy1.mass: {normal: {mean: 1.0, sigma: 1.0}}}", "leaves the range"),
        (
            HEAD + "dispersions: {plant.deputy1.mass: {uniform: {low: 1.0, high: 2.0}, as: sum}}",
            "as: 'sum' is not allowed",
        ),
        (HEAD + "dispersions: {controller.algorithm: {choice: {of: [lqr, lqg]}}}", "leaves the range"),
        (HEAD + "dispersions: {plant.deputy1.mass: {hill_normal: {sigma: [1.0,1.0,1.0,1.0,1.0,1.0]}}}", "of 6"),
        (HEAD + "faults: {a: {fault: stuck, deputy: deputy1}}", "fault a: 'stuck' is unknown"),
        (HEAD + "faults: {a: {fault: stuck_off, deputy: deputy1, at: 3.0}}", "is the same in every case"),
        (HEAD + "faults: {a: {fault: stuck_off, when: 3.0}}", "when is no field of stuck_off"),
        (HEAD + "faults: {a: {fault: leak, at: {uniform: {low: -9.0, high: 1.0}}}}", "leaves the range"),
        (HEAD + "variants: {a: 3}", "variant a: 3 is not allowed"),
        (HEAD + "variants: {a: {controler.algorithm: lqr}}", "node controler is unknown"),
        (HEAD + "sweep: {spiral: {plant.seed: [1, 2]}}", "sweep: spiral is not allowed"),
        (HEAD + "sweep: {grid: {plant.seed: 3}}", "must be a list of values"),
        (HEAD + "sweep: {latin_hypercube: {plant.deputy1.mass: {uniform: {low: 1.0, high: 2.0}}}}", "points: None"),
        (HEAD + "requirements: [final_error < 1.0 in 99 % at 90 % confidence]", "did you mean final_error_m?"),
        (HEAD + "requirements: [final_error_m < 1.0]", "it must be like"),
        (HEAD + "requirements: [final_error_m < 1.0 in 100 % at 90 % confidence]", "share is not allowed"),
        (HEAD + "requirements: [final_error_m inside its band in 99 % at 90 % confidence]", "with a band"),
    ],
)
def test_what_is_not_allowed_is_named_in_one_line(write, text, words):
    assert words in refusal(write(text))


def test_range_that_a_dispersion_leaves_is_named_with_the_cure(write):
    text = refusal(write(HEAD + "dispersions: {plant.deputy1.mass: {normal: {mean: 8.0, sigma: 1.0}}}"))
    assert "above 0" in text
    assert "within: [LOW, HIGH] truncates" in text


def test_draws_of_one_dispersion_do_not_depend_on_the_others(write, small):
    whole = load_campaign(write(small))
    lines = [line for line in small.splitlines() if "relative_state" not in line]
    part = load_campaign(write("\n".join(lines), "part.yaml"))
    for case in range(4):
        one, other = (draw(each, case, nominal_scenario(each, each.configurations[0])) for each in (whole, part))
        assert one["plant.deputy1.mass"] == other["plant.deputy1.mass"]
        assert seed_of(whole, case) == seed_of(part, case)
    assert STATE in one
    assert STATE not in other


def test_flight_software_keeps_what_the_scenario_tells_it(write, small):
    campaign = load_campaign(write(small))
    nominal = nominal_scenario(campaign, campaign.configurations[0])
    drawn = scenario_of(campaign, 1, campaign.configurations[0])
    assert drawn.plant.deputy["deputy1"].mass != nominal.plant.deputy["deputy1"].mass
    assert drawn.deputies == nominal.deputies


def test_orbit_is_drawn_for_all_nodes_alike(write):
    spec = "dispersions: {plant.chief.semi_major_axis: {uniform: {low: -100.0, high: 100.0}, as: offset}}"
    campaign = load_campaign(write(HEAD + spec))
    drawn = scenario_of(campaign, 1, campaign.configurations[0])
    assert drawn.plant.chief.semi_major_axis != 6978100.0
    assert drawn.deputies["deputy1"]["navigation"].chief == drawn.plant.chief


def test_variants_fly_the_same_draws_at_every_point_of_a_sweep(write, small):
    more = "variants: {lqr: {controller.algorithm: lqr}, mpc: {controller.algorithm: mpc}}\n"
    more += "sweep: {grid: {plant.deputy1.sensors.radius.sigma: [1.0, 5.0]}}\n"
    campaign = load_campaign(write(small + more))
    assert [each.name for each in campaign.configurations] == [
        f"{law}, plant.deputy1.sensors.radius.sigma={sigma}" for law in ("lqr", "mpc") for sigma in (1, 5)
    ]
    flown = [scenario_of(campaign, 2, each).plant for each in campaign.configurations]
    assert len({(each.seed, each.deputy["deputy1"].relative_state, each.faults) for each in flown}) == 1
    assert {each.deputy["deputy1"].sensors.radius.sigma for each in flown} == {1.0, 5.0}


def test_latin_hypercube_has_one_point_in_every_stratum(write):
    spec = "sweep: {latin_hypercube: {points: 8, plant.deputy1.mass: {uniform: {low: 80.0, high: 160.0}}}}"
    campaign = load_campaign(write(HEAD + spec))
    masses = sorted(nominal_scenario(campaign, each).plant.deputy["deputy1"].mass for each in campaign.configurations)
    assert [int((mass - 80.0) / 10.0) for mass in masses] == list(range(8))


@pytest.mark.parametrize(
    "path", sorted(find_campaign("leader_follower").parent.glob("*.yaml")), ids=lambda each: each.stem
)
def test_shipped_campaign_can_be_flown(path):
    campaign = load_campaign(path)
    for configuration in campaign.configurations:
        check_dispersions(campaign, configuration)
        scenario_of(campaign, 0, configuration)


def test_variants_may_fly_scenarios_of_their_own(write, tmp_path):
    text = "runs: 2\nvariants: {a: {scenario: leader_follower, plant.tick: 10.0}, b: {scenario: tetrahedral}}\n"
    text += "requirements: [deputy1.final_error_m < 9.0 in 60 % at 60 % confidence]"
    campaign = load_campaign(write(text))
    assert [len(scenario_of(campaign, 0, each).plant.deputies) for each in campaign.configurations] == [1, 4]
    assert [each.stem for each in campaign.scenarios] == ["leader_follower", "tetrahedral"]
    assert "variant c: scenario: None is not allowed" in refusal(write("variants: {c: {plant.tick: 10.0}}"))
    assert "deputy2" in refusal(write(text.replace("deputy1", "deputy2")))


def test_results_have_copies_of_what_a_scenario_extends(write, tmp_path):
    write("extends: leader_follower\n/plant: {ros__parameters: {duration: 600.0}}", "base.yaml")
    mine = write("extends: base.yaml\n/plant: {ros__parameters: {seed: 5}}", "mine.yml")
    campaign, results = load_campaign(write("scenario: mine.yml")), Dataset(tmp_path / "results")
    results.create(campaign, "1", "", 1)
    base = mine.with_name("base.yaml")
    identity, content = campaign.identity, base.read_text()
    base.write_text(content.replace("600", "900"))
    assert campaign.identity != identity
    base.write_text(content)
    mine.unlink()
    base.unlink()
    copied = results.campaign()
    assert copied.identity == identity
    assert scenario_of(copied, 0, copied.configurations[0]).plant.duration == 600.0
