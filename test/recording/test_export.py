import csv
import json

import numpy as np
import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.recording import Bag
from formation_gnc.recording.export import export


def test_csv_keeps_every_bit(bag_path, tmp_path) -> None:
    bag = Bag(bag_path)
    export(bag, "/deputy1/estimate", tmp_path / "estimate.csv")
    with (tmp_path / "estimate.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    arrays = bag.arrays("/deputy1/estimate")
    assert [float(row["covariance.35"]) for row in rows] == arrays["covariance"][:, 35].tolist()
    assert [int(row["stamp_ns"]) for row in rows] == arrays["stamp_ns"].tolist()
    values = "innovations.0.values"
    assert [json.loads(row[values]) if row[values] else None for row in rows] == [
        None if each is None else list(each) for each in arrays[values]
    ]


def test_csv_keeps_text(bag_path, tmp_path) -> None:
    bag = Bag(bag_path)
    export(bag, "/events", tmp_path / "events.csv")
    with (tmp_path / "events.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["detail"] for row in rows] == bag.arrays("/events")["detail"].tolist()


def test_parquet_keeps_numbers_text_and_ragged_arrays(bag_path, tmp_path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    bag = Bag(bag_path)
    for topic in ("/deputy1/measurement", "/truth"):
        export(bag, topic, tmp_path / "topic.parquet")
        table = parquet.read_table(tmp_path / "topic.parquet").to_pydict()
        arrays = bag.arrays(topic)
        assert table["chief_state.0"] == arrays["chief_state"][:, 0].tolist()
    assert table["deputies.1.name"] == arrays["deputies.1.name"].tolist()
    export(bag, "/deputy1/measurement", tmp_path / "topic.parquet")
    readings = parquet.read_table(tmp_path / "topic.parquet").to_pydict()["readings.1.values"]
    recorded = bag.arrays("/deputy1/measurement")["readings.1.values"]
    assert readings == [None if each is None else np.asarray(each).tolist() for each in recorded]


def test_an_export_that_is_not_possible_is_named(bag_path, tmp_path) -> None:
    bag = Bag(bag_path)
    with pytest.raises(ConfigurationError, match=r"\.csv or \.parquet"):
        export(bag, "/clock", tmp_path / "clock.xls")
    with pytest.raises(ConfigurationError, match=r"nowhere/clock.csv: No such file"):
        export(bag, "/clock", tmp_path / "nowhere" / "clock.csv")
    with pytest.raises(ConfigurationError, match="/nothing"):
        export(bag, "/nothing", tmp_path / "clock.csv")
