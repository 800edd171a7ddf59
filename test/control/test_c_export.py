"""The MPC as C: built by a C compiler, it commands what the law did in a recorded run."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formation_gnc.cli import main
from formation_gnc.control.c_export import export_mpc, input_lines
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.mpc import MpcParameters
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


@needs_compiler
@pytest.mark.parametrize(
    ("controller", "limited", "closeness"),
    [
        (TIGHT, True, 1e-9),
        pytest.param({"mpc.off_in_eclipse": True, "mpc.horizon": 45}, False, 1e-9, marks=pytest.mark.thorough),
        # Rounding of the gradient, 1e-14, times the condition of the QP with a polyhedron and a rate: 8e-9.
        pytest.param(
            TIGHT | {"mpc.total_thrust": 0.008, "mpc.thrust_rate": 1e-4}, True, 3e-8, marks=pytest.mark.thorough
        ),
    ],
)
def test_the_c_code_commands_what_the_law_did_in_a_recorded_run(
    controller: dict[str, Any], limited: bool, closeness: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parameters, ticks = recorded(tmp_path / "bag", controller)
    own, limit = parameters.laws["mpc"], np.array(parameters.thrust_limit)
    export_mpc(own, parameters, Vehicle(parameters.mass, limit), tmp_path / "c")
    subprocess.run(["make", "-C", tmp_path / "c", "CFLAGS=-O1"], check=True, capture_output=True)
    lines = "\n".join(input_lines(((estimate, target) for estimate, target, _ in ticks), own.horizon))
    flown = subprocess.run([tmp_path / "c" / "replay"], input=lines, check=True, capture_output=True, text=True)
    found = np.array([line.split() for line in flown.stdout.splitlines()], dtype=float)
    demand = np.array([status.demand for *_, status in ticks])
    iterations = [status.iterations for *_, status in ticks]
    np.testing.assert_allclose(found[:, :3], demand, rtol=0, atol=closeness * limit.max())
    assert found[:, 4].tolist() == iterations
    assert (max(iterations) > 1) == limited, "OSQP has solved what is not within bounds"
    with capsys.disabled():
        print(f"\n  mpc as C: {flown.stderr.strip()}")


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
    ],
)
def test_what_the_c_code_lacks_is_refused(
    lacking: dict[str, Any], words: str, common: Any, vehicle: Vehicle, tmp_path: Path
) -> None:
    with pytest.raises(DesignError, match=f"mpc: {words} cannot be exported to C; it must be"):
        export_mpc(MpcParameters(**lacking), common, vehicle, tmp_path / "c")
    assert not (tmp_path / "c").exists()
