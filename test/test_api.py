"""The public interface: its names, and a flight by them alone."""

import ast
import inspect
from pathlib import Path

import pytest

from formation_gnc import api


def test_type_checkers_see_the_names_that_the_interpreter_gives() -> None:
    tree = ast.parse(Path(api.__file__).read_text(encoding="utf-8"))
    (checked,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {
        alias.asname: each.module for each in checked.body if isinstance(each, ast.ImportFrom) for alias in each.names
    }
    assert seen == api._MODULES


@pytest.mark.parametrize("name", api.__all__)
def test_every_public_name_is_there_and_says_what_it_is(name: str) -> None:
    assert inspect.getdoc(getattr(api, name))


def test_another_name_is_not_public() -> None:
    with pytest.raises(AttributeError, match=r"formation_gnc\.api has no numpy"):
        _ = api.numpy


@pytest.mark.thorough
def test_a_flight_is_flown_judged_reported_and_replayed_by_public_names(tmp_path: Path) -> None:
    scenario = api.load_scenario("leader_follower", {"/plant": {"duration": 40.0}})
    bag = api.fly(scenario, tmp_path / "flown")
    (deputy,) = api.figures(bag).deputies.values()
    assert deputy.final_error_m > 0.0
    assert api.trajectories(bag)["deputy1"].time.size == 40
    page = api.write_report(bag, api.RunHistory(bag), tmp_path / "report.html", "flown")
    assert page.stat().st_size > 100_000
    api.replay_into(bag, tmp_path / "again", ["navigation", "controller"], None)
    outputs = ["/deputy1/estimate", "/deputy1/thrust"]
    assert api.identical(bag, api.Bag(tmp_path / "again"), outputs) == []
