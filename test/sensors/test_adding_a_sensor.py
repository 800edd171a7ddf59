"""A sensor is one file and one registry entry: a toy sensor with a reading of three values flies."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.thorough

# The one file ...
RELATIVE_POSITION = '''
"""Relative position: from the chief to the deputy, along inertial axes."""

from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float, float, float]:
    """r - r_c."""
    return deputy[0] - chief[0], deputy[1] - chief[1], deputy[2] - chief[2]


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """The identity, and zero."""
    for i in range(3):
        jacobian[i, i] = 1.0


RELATIVE_POSITION = Sensor(
    name="relative_position",
    title="relative position",
    unit="m",
    measure=measure,
    differentiate=differentiate,
    sigma=(0.5, 0.5, 1.0),
    sigma_range=(1e-3, 1e6),
    reading_unit=DisplayUnit("hm", 0.01),
    innovation_unit=DisplayUnit("cm", 100.0),
    on=False,
    labels=("X", "Y", "Z"),
)
'''

# ... the one entry, and a flight with it.
FLIGHT = """
import json
import sys
from formation_gnc.sensors.registry import register
from relative_position import RELATIVE_POSITION
register(RELATIVE_POSITION)

from test_adding_a_sensor import fly
print(json.dumps(fly(sys.argv[1])))
"""

SIGMA = (0.5, 0.5, 1.0)


def fly(directory: str) -> dict[str, Any]:
    """Five minutes with the toy sensor every second tick, 20 s late, and outliers; what came of it."""
    from formation_gnc.analysis.report import Origin, write_report
    from formation_gnc.analysis.run_history import RunHistory
    from formation_gnc.recording.in_process_recorder import InProcessRecorder
    from formation_gnc.recording.reader import Bag
    from formation_gnc.recording.writer import BagWriter
    from formation_gnc.records import Estimate, Measurement
    from formation_gnc.sil.runner import Run
    from formation_gnc.sil.scenario import load_scenario
    from tools.write_reference import parameters_page

    toy = "deputy1.sensors.relative_position"
    overrides = {
        "/plant": {
            "duration": 300.0,
            f"{toy}.on": True,
            f"{toy}.interval": 2.0,
            f"{toy}.latency": 20.0,
            f"{toy}.outlier": 0.05,
            f"{toy}.sigma": list(SIGMA),
        },
        "/**/navigation": {
            "sensors": ["radius", "relative_position"],
            "relative_position_sigma": list(SIGMA),
            "fix_position_sigma": 20.0,
        },
    }
    readings, innovations, errors = [], [], []
    with BagWriter(Path(directory) / "bag", {}) as writer:
        record, run = InProcessRecorder(writer), Run(load_scenario("leader_follower", overrides))

        def sink(topic: str, message: Any) -> None:
            record(topic, message)
            if isinstance(message, Measurement):
                relative = run.plant.truth().deputies[0].inertial_state - message.chief_state
                readings.extend(
                    [each.age, each.values, relative[:3].tolist()]
                    for each in message.readings
                    if each.sensor == "relative_position"
                )
            if isinstance(message, Estimate):
                toys = [each for each in message.innovations if each.sensor == "relative_position"]
                innovations.extend([each.values, each.test_ratio, each.rejection] for each in toys)
                error = message.relative_state - run.plant.truth().deputies[0].relative_state
                errors.append([error[:3].tolist(), np.diag(message.covariance)[:3].tolist()])

        run.fly(sink)
    bag = Bag(Path(directory) / "bag")
    report = write_report(bag, RunHistory(bag), Path(directory) / "report.html", "toy", Origin("toy", "")).read_text()
    drawn = ["relative position [hm]", "relative position X", "relative position Z", "innovation [cm]"]
    return {
        "readings": readings,
        "innovations": innovations,
        "errors": errors,
        "not drawn": [text for text in drawn if text not in report],
        "reference": parameters_page(),
    }


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Any:
    directory = tmp_path_factory.mktemp("toy")
    (directory / "relative_position.py").write_text(RELATIVE_POSITION)
    (directory / "flight.py").write_text(FLIGHT)
    root = Path(__file__).parents[2]
    path = os.pathsep.join([str(Path(__file__).parent), str(root), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, str(directory / "flight.py"), str(directory)]
    environment = os.environ | {"PYTHONPATH": path}
    output = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(output.stdout.splitlines()[-1])


def test_the_plant_reads_a_new_sensor(flight: Any) -> None:
    ages, values, _ = zip(*flight["readings"], strict=True)
    assert set(ages) == {20_000_000_000}
    assert len(values) == 140  # of 150 every 2 s, the last ten still on their way
    assert {len(each) for each in values} == {3}


def test_the_filter_uses_a_new_sensor(flight: Any) -> None:
    values, ratios, rejections = zip(*flight["innovations"], strict=True)
    assert len(values) == 140
    rejected = np.array(rejections) == "gate"
    assert 0 < rejected.sum() < 20  # 5 % outliers, all three values of a reading rejected together
    assert ((np.array(ratios) > 1.0) == rejected).all()
    error, variance = (np.array(each) for each in zip(*flight["errors"], strict=True))
    # From 20 m on each axis to what 130 positions of half a metre leave, on all axes and consistently.
    assert (np.sqrt(variance[-1]) < 0.3).all()
    assert (np.abs(error[-1]) < 4.0 * np.sqrt(variance[-1])).all()


def test_the_report_draws_a_new_sensor(flight: Any) -> None:
    assert flight["not drawn"] == []


def test_the_reference_lists_the_parameters_of_a_new_sensor(flight: Any) -> None:
    page = flight["reference"]
    followed = "the plant's `DEPUTY.sensors.relative_position.sigma`"
    assert f"| `relative_position_sigma` | double array | m | {followed} | 3 values, at least 0.001" in page
    assert "| `DEPUTY.sensors.relative_position.bias` | double array | m | `[0.0, 0.0, 0.0]` | 3 values" in page
    assert "| `DEPUTY.sensors.relative_position.on` | bool |  | `false` |" in page
