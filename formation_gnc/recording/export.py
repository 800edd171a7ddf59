"""Topics of a bag as CSV and Parquet files."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.reader import Bag, columns


def export(bag: Bag, topic: str, path: Path) -> None:
    """Write a topic to a .csv or .parquet file: a row per message, a column per field or array element.

    Both keep every bit of a number. An array of varying length is one column: JSON in CSV, a list in Parquet.

    Raises:
        BagError: the bag has no such topic, or cannot be read.
        ConfigurationError: the file type is unknown, pyarrow is not installed, or the path cannot be written.
    """
    writers = {".csv": _write_csv, ".parquet": _write_parquet}
    if path.suffix not in writers:
        raise ConfigurationError(f"export to {path} is not allowed; it must be a file of type {' or '.join(writers)}")
    table = columns(bag.arrays(topic))
    try:
        writers[path.suffix](table, path)
    except OSError as error:
        raise ConfigurationError(f"export to {path}: {error.strerror or error}") from None


def _write_csv(table: dict[str, NDArray[Any]], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(table)
        writer.writerows(zip(*(map(_cell, column.tolist()) for column in table.values()), strict=True))


def _cell(value: Any) -> Any:
    return json.dumps(value.tolist()) if isinstance(value, np.ndarray) else value


def _write_parquet(table: dict[str, NDArray[Any]], path: Path) -> None:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise ConfigurationError("pyarrow is not installed: pip install pyarrow") from None
    parquet.write_table(pa.table({name: pa.array(column.tolist()) for name, column in table.items()}), path)
