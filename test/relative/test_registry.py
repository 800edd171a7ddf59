"""Registry of relative models: the capabilities that they state, and the addition of a model."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formation_gnc.control.models import DESIGN_MODELS, PLAN_MODELS
from formation_gnc.guidance.targets import TARGET_MODELS
from formation_gnc.navigation.process import PROCESS_MODELS
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.relative.model import NO_THRUST, LinearModel, integrate
from formation_gnc.relative.registry import MODELS
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

CHIEF = Elements(7.5e6, 0.05, 1.0, 0.3, 0.4, 0.5)
STATE = np.array([100.0, 200.0, -50.0, 0.1, -0.2, 0.05])

every_model = pytest.mark.parametrize("name", MODELS)
linear = pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model.is_linear])


def about(name: str) -> Any:
    return MODELS[name].about(CHIEF)


def test_models_that_scenarios_name_are_registered():
    names = {"hill", "schweighart_sedwick", "j2_gradient", "tschauner_hempel", "nonlinear_j2", "yamanaka_ankersen"}
    assert names | {"j2_mean_motion", "nonlinear", "oblate"} <= set(MODELS)


@linear
def test_periodic_models_repeat_after_a_period(name: str):
    model = about(name)
    first, second = (model.dynamics(time) for time in (300.0, 300.0 + model.period))
    # Under J2 the perigee turns by 5e-3 rad a revolution, and with it the dynamics about an ellipse.
    same = np.abs(second - first).max() < 1e-9 * np.abs(first).max()
    assert same == model.is_periodic


@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model.has_closed_form])
@pytest.mark.thorough
def test_closed_form_transitions_are_the_integrated_ones(name: str):
    model = about(name)
    duration, unit = 2.3 * model.period, np.repeat([1.0, 1e-3], 3)
    integrated = integrate(lambda time, phi: model.dynamics(time) @ phi, 300.0, np.eye(6), duration, 20.0)
    closed = model.transition(300.0, duration)
    np.testing.assert_allclose(closed * unit / unit[:, None], integrated * unit / unit[:, None], atol=1e-7)
    together = model.transitions(300.0, np.array([0.0, duration]))
    np.testing.assert_allclose(together, [np.eye(6), closed], rtol=1e-12, atol=1e-12)


@every_model
def test_exact_models_are_the_difference_of_two_orbits_under_j2(name: str):
    chief = state_from_elements(CHIEF)
    deputy = inertial_from_relative(chief, STATE)
    chief, deputy = (propagate_with_transition(each, NO_THRUST, 3000.0, 100)[0] for each in (chief, deputy))
    error = about(name).propagate(0.0, STATE, 3000.0) - relative_from_inertial(chief, deputy)
    assert (np.linalg.norm(error[:3]) < 1e-6) == MODELS[name].is_exact_under_j2


@every_model
def test_models_without_j2_do_not_depend_on_inclination(name: str):
    tilted = Elements(7.5e6, 0.05, 1.5, 0.3, 0.4, 0.5)
    flown, other = (MODELS[name].about(chief).propagate(0.0, STATE, 500.0) for chief in (CHIEF, tilted))
    assert np.array_equal(flown, other) is not MODELS[name].has_j2


def test_phase_rates_are_those_of_free_motion_about_a_circular_chief():
    chief = Elements(7.5e6, 0.0, 1.0, 0.0, 0.0, 0.0)
    for name, model in MODELS.items():
        if issubclass(model, LinearModel):
            rates = np.array(model.about(chief).phase_rates(0.0))
            # J2 changes them by parts in a thousand.
            assert rates == pytest.approx(chief.mean_motion, rel=3e-3), name


def test_documented_roles_are_those_that_are_offered():
    page = (Path(__file__).parents[2] / "docs/theory/relative-motion.md").read_text()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines() if line.startswith("| ")]
    roles = {name: row[5:] for row in rows[1:] for name in re.findall(r"`(\w+)`", row[1])}
    offered = (DESIGN_MODELS, PROCESS_MODELS, TARGET_MODELS, PLAN_MODELS)
    assert roles == {name: ["yes" if name in names else "" for names in offered] for name in MODELS}


# One file.
TOY = '''
"""Hill's equations at a rate that is off by a part in a thousand."""

from dataclasses import dataclass
from typing import Self

from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.hill import HarmonicModel


@dataclass(frozen=True)
class ToyModel(HarmonicModel):
    """Example of a model."""

    rate: float

    @classmethod
    def about(cls, chief: Elements) -> Self:
        """At about the chief's mean motion."""
        return cls(0.999 * chief.mean_motion)

    @property
    def frequencies(self) -> tuple[float, float, float]:
        """All equal."""
        return self.rate, self.rate, self.rate
'''

# One line, then a run with the model in every role that it can serve.
FLIGHT = """
import json
from formation_gnc.relative import registry
from toy import ToyModel
registry.MODELS["toy"] = ToyModel

from test_registry import run_scenario
print(json.dumps(run_scenario("toy")))
"""


def run_scenario(model: str) -> dict[str, Any]:
    """A quarter of an orbit with one model for design, target and filter."""
    overrides = {
        "/plant": {"duration": 1500.0},
        "/**/navigation": {"process_model": model},
        "/**/guidance": {"model": model},
        "/**/controller": {"lqr.model": model},
    }
    run = Run(load_scenario("leader_follower", overrides))
    records: dict[str, list[Any]] = {}
    run.fly(lambda topic, record: records.setdefault(topic, []).append(record))
    end = records["/truth"][-1].deputies[0].relative_state
    return {
        "error": float(np.linalg.norm((end - records["/deputy1/target"][-1].relative_state)[:3])),
        "estimate": float(np.linalg.norm((end - records["/deputy1/estimate"][-1].relative_state)[:3])),
        "first command": records["/deputy1/thrust"][0].force.tolist(),
    }


@pytest.mark.thorough
def test_new_model_is_one_file_and_one_line(tmp_path):
    (tmp_path / "toy.py").write_text(TOY)
    (tmp_path / "flight.py").write_text(FLIGHT)
    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    run = [sys.executable, str(tmp_path / "flight.py")]
    output = subprocess.run(run, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=True)
    toy, hill = json.loads(output.stdout), run_scenario("hill")
    assert toy["first command"] != hill["first command"]
    assert toy["first command"] == pytest.approx(hill["first command"], rel=0.01)
    # The start is 17 m off.
    assert toy["error"] == pytest.approx(hill["error"], rel=0.1)
    assert toy["error"] < 10.0
    assert toy["estimate"] < 2.0
