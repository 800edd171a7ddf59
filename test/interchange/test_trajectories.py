"""Trajectories as files of others: read back by other readers, they are the recorded truth."""

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat, netcdf_file

from formation_gnc.cli import main
from formation_gnc.errors import BagError
from formation_gnc.interchange.ephemeris import Ephemeris, ephemerides
from formation_gnc.interchange.formats import OF_ALL, OF_ONE
from formation_gnc.interchange.times import utc
from formation_gnc.recording.reader import Bag

pytestmark = pytest.mark.usefixtures("without_pictures")

EPOCH = "2026-11-28T12:00:00Z"
START = datetime(2026, 11, 28, 12, tzinfo=UTC)
TT_MINUS_UTC = 69.184
"""s; 37 leap seconds since 2017."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twenty ticks of two satellites, from a date."""
    path = tmp_path_factory.mktemp("flight") / "pair"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("signal.signal", lambda *_: None)
        options = ["--in-process", "--duration", "20", "--set", f"plant.epoch={EPOCH}", "--bag", str(path), "--json"]
        assert main(["sil", "leader_follower", *options]) == 0
    return path


@pytest.fixture
def export(bag, tmp_path, capsys):
    """Files of an export in a format."""

    def run(kind: str) -> list[Path]:
        capsys.readouterr()
        assert main(["export", str(bag), "--format", kind, "--output", str(tmp_path / kind)]) == 0
        files = [Path(line) for line in capsys.readouterr().out.splitlines()]
        assert sorted(files) == sorted((tmp_path / kind).iterdir())
        return files

    return run


def truth(bag: Path) -> list[Ephemeris]:
    return ephemerides(Bag(bag))


def test_an_oem_holds_the_bits_of_the_truth(bag, export):
    files = export("oem")
    assert [path.name for path in files] == ["pair_chief.oem", "pair_deputy1.oem"]
    for path, satellite in zip(files, truth(bag), strict=True):
        text = path.read_text()
        head, _, body = text.partition("META_STOP\n\n")
        meta = dict(line.split(" = ") for line in head.splitlines() if " = " in line)
        assert meta["OBJECT_NAME"] == satellite.name
        assert (meta["REF_FRAME"], meta["TIME_SYSTEM"], meta["CENTER_NAME"]) == ("EME2000", "TT", "EARTH")
        rows = [line.split() for line in body.splitlines()]
        first = START + timedelta(seconds=TT_MINUS_UTC)
        assert [row[0] for row in rows[1:3]] == [
            f"{first + timedelta(seconds=second):%Y-%m-%dT%H:%M:%S.%f}000" for second in (1, 2)
        ]
        assert (meta["START_TIME"], meta["STOP_TIME"]) == (rows[0][0], rows[-1][0])
        states = np.array([list(map(float, row[1:])) for row in rows]) * 1e3
        # Times 0.001 and back: two roundings.
        np.testing.assert_allclose(states, satellite.states, rtol=3e-16)


def test_an_stk_ephemeris_holds_the_bits_of_the_truth(bag, export):
    for path, satellite in zip(export("stk"), truth(bag), strict=True):
        lines = path.read_text().splitlines()
        assert lines[0] == "stk.v.12.0"
        assert "ScenarioEpoch 28 Nov 2026 12:00:00.000000" in lines
        begin, end = lines.index("EphemerisTimePosVel") + 2, lines.index("END Ephemeris") - 1
        rows = np.array([list(map(float, line.split())) for line in lines[begin:end]])
        assert f"NumberOfEphemerisPoints {len(rows)}" in lines
        np.testing.assert_array_equal(rows, np.column_stack((satellite.times, satellite.states)))


def test_a_scene_for_cesium_has_every_satellite_in_inertial_axes(bag, export):
    (path,) = export("czml")
    document, *packets = json.loads(path.read_text())
    assert document["id"] == "document"
    assert document["clock"]["interval"] == "2026-11-28T12:00:00.000000Z/2026-11-28T12:00:19.000000Z"
    for packet, satellite in zip(packets, truth(bag), strict=True):
        assert packet["id"] == satellite.name
        position = packet["position"]
        assert (position["referenceFrame"], position["epoch"]) == ("INERTIAL", "2026-11-28T12:00:00.000000Z")
        rows = np.array(position["cartesian"]).reshape(-1, 4)
        np.testing.assert_array_equal(rows, np.column_stack((satellite.times, satellite.states[:, :3])))


def test_netcdf_has_units_and_frames(bag, export):
    (path,) = export("netcdf")
    chief, deputy = truth(bag)
    with netcdf_file(path, mmap=False) as file:
        position, relative = file.variables["position"], file.variables["relative_position"]
        assert (position.units, relative.units) == (b"m", b"m")
        assert position.frame.startswith(b"inertial: mean equator and equinox of J2000")
        np.testing.assert_array_equal(position[:, 0], chief.states[:, :3])
        np.testing.assert_array_equal(relative[:, 1], deputy.relative[:, :3])
        np.testing.assert_array_equal(file.variables["time"][:], chief.times)
        assert [b"".join(each).strip() for each in file.variables["satellite_name"][:]] == [b"chief", b"deputy1"]


def test_matlab_reads_the_same_variables(bag, export):
    (path,) = export("mat")
    found, (chief, deputy) = loadmat(path, squeeze_me=True), truth(bag)
    np.testing.assert_array_equal(found["velocity"][:, 0], chief.states[:, 3:])
    np.testing.assert_array_equal(found["relative_velocity"][:, 1], deputy.relative[:, 3:])
    assert list(found["satellites"]) == ["chief", "deputy1"]
    assert str(found["units"]["velocity"]) == "m/s"


@pytest.mark.parametrize("kind", [*OF_ONE, *OF_ALL])
def test_an_export_is_the_same_file_again(kind, bag, export, tmp_path):
    first = [path.read_bytes() for path in export(kind)]
    if kind != "mat":  # SciPy writes the date into the header
        assert [path.read_bytes() for path in export(kind)] == first


def test_topics_are_not_asked_of_a_format_of_trajectories(bag, capsys):
    assert main(["export", str(bag), "--format", "oem", "--topic", "/truth"]) == 2
    assert "format oem: holds trajectories; neither --topic nor --attachments" in capsys.readouterr().err


def test_a_truth_that_is_not_finite_is_refused(bag, monkeypatch):
    arrays = Bag.arrays

    def with_a_hole(self: Bag, *arguments: object) -> object:
        found = arrays(self, *arguments)
        found["deputies.0.inertial_state"][3, 1] = np.nan
        return found

    monkeypatch.setattr(Bag, "arrays", with_a_hole)
    with pytest.raises(BagError, match="truth of deputy1 at 3 s is not finite; it must be"):
        ephemerides(Bag(bag))


def test_utc_knows_the_leap_seconds():
    assert utc(0.0) == datetime(2000, 1, 1, 11, 58, 55, 816000, tzinfo=UTC)
    assert abs(utc(9828 * 86400.0 + TT_MINUS_UTC) - START) < timedelta(microseconds=2)
