"""The MPC as C: built by a C compiler, it commands what the law did in a recorded run."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formation_gnc.cli import main
from formation_gnc.control.c_export import export_mpc, input_lines
from formation_gnc.control.condensed_qp import CondensedQp
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.mpc import ModelPredictiveController, MpcParameters
from formation_gnc.errors import DesignError
from formation_gnc.messages.conversion import from_cdr
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import NavigationState, Status, Target
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

needs_compiler = pytest.mark.skipif(not (shutil.which("cc") and shutil.which("make")), reason="no C compiler")

TIGHT = {"mpc.position_error": [1.0] * 3, "mpc.velocity_error": [0.01] * 3, "mpc.thrust": [0.01] * 3}
"""Weights that ask for more than 10 mN from metres off."""

NEARLY_SINGULAR = {"mpc.weighting": "terminal", "mpc.position_error": [1.0] * 3}
"""Weights that leave all but the end of a plan to the cost of thrust."""


def recorded(bag: Path, controller: dict[str, Any]) -> tuple[Any, list[Any]]:
    """The controller's parameters, and estimate, target and status of each tick, as read from the bag of a run."""
    scenario = load_scenario(
        "leader_follower",
        {
            "/**": {"tick": 10.0},
            "/plant": {"duration": 2000.0},
            "/**/controller": {"algorithm": "mpc"} | controller,
            "/**/guidance": {"preview_steps": 10, "preview_step": 60.0},
        },
    )
    with BagWriter(bag, {}) as writer:
        Run(scenario).fly(InProcessRecorder(writer))
    topics = {"/deputy1/estimate": NavigationState, "/deputy1/target": Target, "/deputy1/status": Status}
    read = ([from_cdr(kind, data) for _, data, _ in Bag(bag).messages([topic])] for topic, kind in topics.items())
    return scenario.deputies["deputy1"]["controller"], list(zip(*read, strict=True))


def flown_by_c(parameters: Any, ticks: list[Any], folder: Path) -> tuple[Any, str]:
    """Lines of the replay of an export: force (3), status and iterations of each tick; and what it says of times."""
    vehicle = Vehicle(parameters.mass, np.array(parameters.thrust_limit))
    export_mpc(parameters.laws["mpc"], parameters, vehicle, folder)
    subprocess.run(["make", "-C", folder, "CFLAGS=-O1"], check=True, capture_output=True)
    inputs = ((estimate, target) for estimate, target, _ in ticks)
    lines = "\n".join(input_lines(inputs, parameters.laws["mpc"].horizon))
    flown = subprocess.run([folder / "replay"], input=lines, check=True, capture_output=True, text=True)
    return np.array([line.split() for line in flown.stdout.splitlines()], dtype=float), flown.stderr.strip()


def summed_in_order(matrix: Any, vector: Any) -> Any:
    """Matrix times vector term by term from the first, as a loop in C does and BLAS does not."""
    return np.cumsum(matrix * vector, axis=-1)[..., -1]


def tracking_in_order(qp: CondensedQp, estimate: NavigationState, target: Target, _: int) -> tuple[Any, float]:
    """`CondensedQp.tracking` with a preview, its sums in the order of the C code."""
    goals = target.preview[: len(qp.transitions)].tolist()
    while len(goals) < len(qp.transitions):
        goals.append(summed_in_order(qp.transitions[0], np.array(goals[-1])))
    errors = summed_in_order(qp.free.reshape(-1, 6, 6), estimate.relative_state) - np.array(goals)
    cost = float(np.sum(errors * (qp.weight @ errors[:, :, None])[:, :, 0]))
    return summed_in_order(qp.gradient, errors.ravel()), cost


@needs_compiler
@pytest.mark.thorough
def test_with_gradients_summed_as_in_c_the_law_is_the_c_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where OSQP runs from plan to plan, 1e-14 of the gradient grows to 8e-9 of the limit, and to no more."""
    polyhedron = TIGHT | {"mpc.total_thrust": 0.008, "mpc.thrust_rate": 1e-4}
    parameters, ticks = recorded(tmp_path / "bag", polyhedron)
    found, _ = flown_by_c(parameters, ticks, tmp_path / "c")
    limit = np.array(parameters.thrust_limit)
    monkeypatch.setattr(CondensedQp, "tracking", tracking_in_order)
    law = ModelPredictiveController(parameters.laws["mpc"], parameters, Vehicle(parameters.mass, limit))
    demand = np.array([law.command(estimate, target).force for estimate, target, _ in ticks])
    np.testing.assert_allclose(found[:, :3], demand, rtol=0, atol=1e-11 * limit.max())
    recorded_demand = np.array([status.demand for *_, status in ticks])
    np.testing.assert_allclose(found[:, :3], recorded_demand, rtol=0, atol=3e-8 * limit.max())


@pytest.mark.covers("Kremmydas Listing: embedded C", "control/c_export.py")
@needs_compiler
@pytest.mark.parametrize(
    ("controller", "limited"),
    [
        (TIGHT, True),
        pytest.param({"mpc.off_in_eclipse": True, "mpc.horizon": 45}, False, marks=pytest.mark.thorough),
        # The largest condition that is exported, nearly: 3.3e6.
        pytest.param(NEARLY_SINGULAR | {"mpc.thrust": [0.3] * 3}, False, marks=pytest.mark.thorough),
    ],
)
def test_the_c_code_commands_what_the_law_did_in_a_recorded_run(
    controller: dict[str, Any], limited: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parameters, ticks = recorded(tmp_path / "bag", controller)
    limit = np.array(parameters.thrust_limit)
    found, times = flown_by_c(parameters, ticks, tmp_path / "c")
    demand = np.array([status.demand for *_, status in ticks])
    iterations = [status.iterations for *_, status in ticks]
    np.testing.assert_allclose(found[:, :3], demand, rtol=0, atol=1e-9 * limit.max())
    assert found[:, 4].tolist() == iterations
    assert (max(iterations) > 1) == limited, "OSQP has solved what is not within bounds"
    with capsys.disabled():
        print(f"\n  mpc as C: {times}")


def test_the_command_writes_the_code_to_a_new_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "c"
    arguments = ["design", "leader_follower", "--controller", "mpc", "--export-c", str(folder)]
    assert main(arguments) == 0
    assert f"C: {folder}" in capsys.readouterr().out
    assert {"mpc.c", "mpc.h", "mpc_data.c", "mpc_data.h", "Makefile", "osqp"} <= {
        each.name for each in folder.iterdir()
    }
    assert main(arguments) == 2
    assert f"export-c {folder}: File exists" in capsys.readouterr().err
    assert main([*arguments[:3], "lqr", "--export-c", str(tmp_path / "d")]) == 2
    assert "export-c: lqr cannot be exported; it must be mpc" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("lacking", "words"),
    [
        ({"model": "tschauner_hempel"}, "model tschauner_hempel, which varies along the orbit"),
        ({"cost": "absolute"}, "cost absolute"),
        ({"keep_out_radius": 20.0}, "keep_out_radius 20"),
        ({"off_in_eclipse": True, "thrust_rate": 1e-4, "horizon": 45}, "off_in_eclipse with thrust_rate"),
        ({"weighting": "terminal", "thrust": (10.0,) * 3}, "a QP of condition 3.7e+09"),
    ],
)
def test_what_the_c_code_lacks_is_refused(
    lacking: dict[str, Any], words: str, common: Any, vehicle: Vehicle, tmp_path: Path
) -> None:
    with pytest.raises(DesignError, match=re.escape(f"mpc: {words} cannot be exported to C; it must be")):
        export_mpc(MpcParameters(**lacking), common, vehicle, tmp_path / "c")
    assert not (tmp_path / "c").exists()
