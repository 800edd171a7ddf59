"""Results of a campaign on disk: a Parquet data set in parts, each written whole by the worker that flew it.

A directory of results has the campaign's file, its scenarios, `campaign.json` (what and which software), and

- `cases/`: a row for each case and configuration: figures, drawn values, seed, reason of a failure, version;
- `errors/`: errors over time in the Hill frame, thinned, a row for each case, configuration and deputy;
- `timing/`: wall time of each flight: apart, since all else is the same bits whoever flies it.

A part is named by its range of cases. Parts may come in any order, from any number of workers, and again.
"""

import json
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow.dataset import dataset, field

from formation_gnc.campaign.case import CASE, VARIANT
from formation_gnc.campaign.definition import Campaign, load_campaign
from formation_gnc.errors import ConfigurationError
from formation_gnc.types import AXES, Matrix

CASES, ERRORS, TIMING = "cases", "errors", "timing"

MANIFEST = "campaign.json"

_PART = re.compile(r"part-(\d+)-(\d+)\.parquet")

Range = tuple[int, int]
"""First case, and the one after the last."""


def part_name(cases: Range) -> str:
    """Name of the files with a range of cases."""
    return f"part-{cases[0]:08d}-{cases[1]:08d}.parquet"


class Dataset:
    """A directory of results."""

    def __init__(self, directory: Path) -> None:
        """Name it; nothing is read."""
        self.directory = directory

    @property
    def manifest(self) -> dict[str, Any]:
        """Contents of its manifest; raises ConfigurationError for a directory that is none of results."""
        try:
            contents = json.loads((self.directory / MANIFEST).read_text())
            return {key: contents[key] for key in ("identity", "version", "commit", "scenario", "campaign", "block")}
        except (OSError, ValueError, KeyError, TypeError):
            raise ConfigurationError(
                f"results {self.directory}: is no directory of a campaign; name another, or one that does not exist"
            ) from None

    def create(self, campaign: Campaign, version: str, commit: str, block: int) -> None:
        """Make the directory, with copies of the campaign's file and its scenarios."""
        for name in (CASES, ERRORS, TIMING):
            (self.directory / name).mkdir(parents=True, exist_ok=True)
        names = {"scenario": "scenario", "campaign": f"{campaign.name}.yaml"}
        for name, path in campaign.copied().items():
            copy = self.directory / names["scenario"] / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, copy)
        (self.directory / names["campaign"]).write_text(campaign.text, encoding="utf-8")
        manifest = {"identity": campaign.identity, "version": version, "commit": commit, "block": block, **names}
        _replace(self.directory / MANIFEST, lambda path: path.write_text(json.dumps(manifest, indent=2) + "\n"))

    def campaign(self, runs: int | None = None) -> Campaign:
        """The campaign, from the copies in the directory."""
        manifest = self.manifest
        return load_campaign(self.directory / manifest["campaign"], runs, self.directory / manifest["scenario"])

    def done(self) -> list[Range]:
        """Ranges of cases that are there, in order."""
        found = (_PART.fullmatch(path.name) for path in (self.directory / CASES).glob("part-*.parquet"))
        return sorted((int(each[1]), int(each[2])) for each in found if each)

    def missing(self, runs: int, block: int) -> Iterator[Range]:
        """Ranges of at most `block` cases that are not there, up to `runs`."""
        at = 0
        for first, end in [*self.done(), (runs, runs)]:
            stop = min(first, runs)
            while at < stop:
                until = min((at // block + 1) * block, stop)
                yield at, until
                at = until
            at = max(at, end)

    def write(
        self, cases: Range, rows: Sequence[Mapping[str, Any]], curves: Sequence[Mapping[str, Any]], wall: Any
    ) -> None:
        """Write a part; that of `cases/` last, since it says that the part is done."""
        name = part_name(cases)
        for folder, values in ((TIMING, wall), (ERRORS, curves), (CASES, rows)):
            if not values:
                continue
            table = _table(values)
            _replace(self.directory / folder / name, lambda path, table=table: pq.write_table(table, path))

    def table(
        self, names: Sequence[str], folder: str = CASES, runs: int | None = None, flights: Any = None
    ) -> pa.Table:
        """Columns of all parts with case and configuration, sorted by them; what a part lacks is null.

        Args:
            names: of the columns.
            folder: which data set.
            runs: cases from this one on are left out.
            flights: name of a configuration; all others are left out.
        """
        files = self._files(folder, runs)
        wanted = list(dict.fromkeys([CASE, VARIANT, *names]))
        if not files:
            return pa.table({name: pa.nulls(0) for name in wanted})
        schema = pa.unify_schemas([pq.read_schema(path) for path in files], promote_options="permissive")
        chosen = field(CASE) >= 0
        if runs is not None:
            chosen = chosen & (field(CASE) < runs)
        if flights is not None:
            chosen = chosen & (field(VARIANT) == flights)
        there = [name for name in wanted if name in schema.names]
        table = dataset(files, schema=schema, format="parquet").to_table(columns=there, filter=chosen)
        for name in wanted:
            if name not in table.column_names:
                table = table.append_column(name, pa.nulls(len(table), pa.float64()))
        return table.sort_by([(CASE, "ascending"), (VARIANT, "ascending")])

    def names(self) -> list[str]:
        """Names of the columns of `cases/`, of all parts together."""
        known: dict[str, None] = {}
        for path in self._files(CASES, None):
            known |= dict.fromkeys(pq.read_schema(path).names)
        return list(known)

    def _files(self, folder: str, runs: int | None) -> list[Path]:
        paths = (
            self.directory / folder / part_name((first, end))
            for first, end in self.done()
            if runs is None or first < runs
        )
        return [path for path in paths if path.exists()]


def curve_rows(row: Mapping[str, Any], curves: Mapping[str, Matrix]) -> Iterator[dict[str, Any]]:
    """Rows of `errors/` of a flight."""
    for deputy, error in curves.items():
        axes = {axis: error[:, number].astype(np.float32) for number, axis in enumerate(AXES)}
        yield {CASE: row[CASE], VARIANT: row[VARIANT], "deputy": deputy, **axes}


def _table(rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    names: Iterable[str] = dict.fromkeys(name for row in rows for name in row)
    columns = {name: [row.get(name) for row in rows] for name in names}
    return pa.table({name: pa.array(_plain(column)) for name, column in columns.items()})


def _plain(column: list[Any]) -> list[Any]:
    """A column of one type: whole numbers among others become floating-point."""
    kinds = {type(each) for each in column if each is not None}
    if kinds == {int, float}:
        return [None if each is None else float(each) for each in column]
    return [str(each) if isinstance(each, str) else each for each in column]


def _replace(path: Path, write: Any) -> None:
    """Write a file beside its place, and put it there whole."""
    temporary = path.with_name(f".{path.name}.{np.random.SeedSequence().entropy:x}")
    try:
        write(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
