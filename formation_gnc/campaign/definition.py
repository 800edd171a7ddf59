"""A campaign's file: scenario, dispersions, faults, variants, sweep and requirements, checked before anything flies."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

import yaml

from formation_gnc.campaign.dispersion import DispersedFault, Dispersion, dispersion_of, fault_of
from formation_gnc.campaign.distributions import LEAST, distribution_of
from formation_gnc.campaign.requirement import Requirement, requirement_of
from formation_gnc.errors import ConfigurationError, nearest
from formation_gnc.limited_yaml import RejectedYamlError
from formation_gnc.parameters import read_yaml
from formation_gnc.plain_file import read_plain
from formation_gnc.randomness import generator
from formation_gnc.shipped import find_shipped
from formation_gnc.sil.overrides import address_of
from formation_gnc.sil.scenario import extended, find_scenario, load_scenario

SCENARIO = "scenario"
"""Key of the scenario, of the campaign or of a variant that flies another one."""

KEYS = (SCENARIO, "seed", "runs", "set", "dispersions", "faults", "variants", "sweep", "requirements")

SWEEPS = ("grid", "latin_hypercube")

NOMINAL = "nominal"
"""Name of the only configuration of a campaign without variants and sweep."""

Overrides = Mapping[str, Mapping[str, Any]]
"""Values by node pattern and dotted name."""


@dataclass(frozen=True, eq=False)
class Configuration:
    """What is flown on the same cases as other configurations: a variant at a point of the sweep.

    Each is equal to itself alone, so that what is derived from it can be kept by it.
    """

    name: str
    scenario: Path
    overrides: Overrides


@dataclass(frozen=True)
class Campaign:
    """A campaign, ready to fly.

    Attributes:
        name: of its file.
        text: of its file.
        scenarios: their files, each once, in the order of the configurations.
        seed: of all that is drawn.
        runs: cases.
        configurations: flown on every case.
        dispersions: of parameters.
        faults: dispersed.
        requirements: on the flights.
    """

    name: str
    text: str
    scenarios: tuple[Path, ...]
    seed: int
    runs: int
    configurations: tuple[Configuration, ...]
    dispersions: tuple[Dispersion, ...]
    faults: tuple[DispersedFault, ...]
    requirements: tuple[Requirement, ...]

    @property
    def identity(self) -> str:
        """Digest of all that decides on the flights besides the software, but not of how many there are."""
        scenarios = "\n".join(path.read_text() for each in self.scenarios for path in extended(each))
        return sha256(f"{self.text}\n{self.seed}\n{scenarios}".encode()).hexdigest()

    def copied(self) -> dict[str, Path]:
        """Files of the scenarios, with those beside them that they extend, by path in a directory of copies.

        Raises:
            ConfigurationError: two have the same name, or one extends a file further up.
        """
        files: dict[str, Path] = {}
        for scenario in self.scenarios:
            for path in extended(scenario):
                if not path.is_relative_to(scenario.parent):
                    continue  # shipped, and found by its name
                name = f"{scenario.stem}.yaml" if path == scenario else str(path.relative_to(scenario.parent))
                if ".." in Path(name).parts:
                    raise ConfigurationError(f"scenario {scenario}: extends a file further up; put it beside it")
                if files.setdefault(name, path) != path:
                    raise ConfigurationError(f"scenarios {files[name]} and {path}: have the same name")
        return files

    @property
    def within(self) -> tuple[float, ...]:
        """Distances (m) that requirements ask the time to be within of."""
        distances = {each.within for each in self.requirements}
        return tuple(sorted(each for each in distances if each is not None))


def find_campaign(name: str) -> Path:
    """Path of a campaign's file, given its name in `campaigns/` or its path."""
    return find_shipped(name, "campaign", "campaigns", "a file")


def load_campaign(path: Path, runs: int | None = None, copies: Path | None = None) -> Campaign:
    """Read and check a campaign.

    Args:
        path: of its file.
        runs: cases in place of the file's.
        copies: directory with copies of the scenarios, in place of those that it names.

    Raises:
        ConfigurationError: the file cannot be read, is no campaign, or says what is not allowed.
    """
    try:
        text = read_plain(path).decode()
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise ConfigurationError(f"{path}: not YAML (not UTF-8)") from None
    try:
        document = read_yaml(text)
    except RejectedYamlError as error:
        raise ConfigurationError(f"{path}: {error}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise ConfigurationError(f"{path}: not YAML ({' '.join(str(error).split())})") from None
    try:
        return _campaign(path, text, document, runs, copies)
    except ConfigurationError as error:
        raise ConfigurationError(f"{path.name}: {error}") from None


def _campaign(path: Path, text: str, document: Any, runs: int | None, copies: Path | None) -> Campaign:
    if not isinstance(document, dict) or not (SCENARIO in document or "variants" in document):
        raise ConfigurationError(f"is no campaign; it must have a scenario, and may have {', '.join(KEYS[1:])}")
    for key in document:
        if key not in KEYS:
            raise ConfigurationError(f"{key}: unknown; {nearest(str(key), KEYS)}")
    for key in ("dispersions", "faults", "set", "variants", "sweep"):
        if not isinstance(document.get(key, {}), dict):
            raise ConfigurationError(
                f"{key}: {document[key]!r} is not allowed; it must map names to what they are given"
            )
    dispersions = tuple(dispersion_of(name, spec) for name, spec in document.get("dispersions", {}).items())
    faults = tuple(fault_of(name, spec) for name, spec in document.get("faults", {}).items())
    seed = _whole("seed", document.get("seed", 1), 0)
    configurations = tuple(_configurations(document, seed, path.parent, copies))
    scenarios = tuple(dict.fromkeys(each.scenario for each in configurations))
    # a requirement may name a deputy that all configurations have
    fleets = [load_scenario(str(each.scenario), each.overrides).plant.deputies for each in configurations]
    deputies = [name for name in fleets[0] if all(name in fleet for fleet in fleets)]
    statements = document.get("requirements", [])
    if not isinstance(statements, list):
        raise ConfigurationError(f"requirements: {statements!r} is not allowed; it must be a list of statements")
    requirements = tuple(requirement_of(each, deputies) for each in statements)
    runs = _whole("runs", document.get("runs", 852) if runs is None else runs, 1)
    campaign = Campaign(path.stem, text, scenarios, seed, runs, configurations, dispersions, faults, requirements)
    campaign.copied()
    return campaign


def _whole(name: str, value: Any, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ConfigurationError(f"{name}: {value!r} is not allowed; it must be a whole number of at least {least}")
    return value


def _configurations(
    document: Mapping[str, Any], seed: int, beside: Path, copies: Path | None
) -> Iterator[Configuration]:
    """Every variant at every point of the sweep."""
    base = _overrides("set", document.get("set", {}))
    variants: dict[str, Any] = document.get("variants", {}) or {"": {}}
    points = list(_points(document.get("sweep", {}), seed)) or [{}]
    for name, values in variants.items():
        given = dict(values) if isinstance(values, dict) else values
        flown = given.pop(SCENARIO, None) if isinstance(given, dict) else None
        scenario = _scenario(document.get(SCENARIO) if flown is None else flown, name, beside, copies)
        own = _overrides(f"variant {name}", given)
        for point in points:
            words = [name] if name else []
            words += [
                f"{parameter}={value if isinstance(value, str) else f'{value:g}'}" for parameter, value in point.items()
            ]
            yield Configuration(", ".join(words) or NOMINAL, scenario, _merged(base, own, _overrides("sweep", point)))


def _scenario(name: Any, variant: str, beside: Path, copies: Path | None) -> Path:
    """File of a scenario given by name, or by its path from the campaign's own directory."""
    if not isinstance(name, str):
        raise ConfigurationError(
            f"{f'variant {variant}: ' if variant else ''}scenario: {name!r} is not allowed; it must be a name or a file"
        )
    if copies is not None:
        return (copies / f"{Path(name).stem}.yaml").absolute()
    return find_scenario(str(beside / name) if name.endswith((".yaml", ".yml")) else name).absolute()


def _overrides(source: str, values: Any) -> Overrides:
    if not isinstance(values, dict):
        raise ConfigurationError(f"{source}: {values!r} is not allowed; it must map NODE.PARAMETER to values")
    overrides: dict[str, dict[str, Any]] = {}
    for target, value in values.items():
        if isinstance(value, dict) or value is None:
            raise ConfigurationError(
                f"{source}: {target}: {value!r} is not allowed; it must be a value or a list of them"
            )
        pattern, name = address_of(target, f"{source}: {target}")
        overrides.setdefault(pattern, {})[name] = value
    return overrides


def _merged(*parts: Overrides) -> Overrides:
    merged: dict[str, dict[str, Any]] = {}
    for part in parts:
        for pattern, values in part.items():
            merged[pattern] = merged.pop(pattern, {}) | dict(values)
    return dict(sorted(merged.items(), key=lambda item: "*" not in item[0]))


def _points(sweep: Mapping[str, Any], seed: int) -> Iterator[dict[str, Any]]:
    """Values of the swept parameters at each point."""
    if not sweep:
        return
    if len(sweep) != 1 or next(iter(sweep)) not in SWEEPS:
        raise ConfigurationError(f"sweep: {', '.join(sweep)} is not allowed; it must be one of {', '.join(SWEEPS)}")
    kind, spec = next(iter(sweep.items()))
    if not isinstance(spec, dict) or not spec:
        raise ConfigurationError(f"sweep: {kind}: {spec!r} is not allowed; it must map NODE.PARAMETER to values")
    if kind == "grid":
        for name, values in spec.items():
            if not isinstance(values, list) or not values:
                raise ConfigurationError(f"sweep: {name}: {values!r} is not allowed; it must be a list of values")
        yield from (dict(zip(spec, point, strict=True)) for point in product(*spec.values()))
        return
    spec = dict(spec)
    count = _whole("sweep: points", spec.pop("points", None), 2)
    columns = {}
    for name, each in spec.items():
        try:
            distribution = distribution_of(each)
        except ConfigurationError as error:
            raise ConfigurationError(f"sweep: {name}: {error}") from None
        random = generator(seed, f"sweep/{name}")
        strata = (random.permutation(count) + random.random(count)) / count
        columns[name] = [distribution.quantile(min(max(u, LEAST), 1.0 - LEAST)) for u in strata.tolist()]
    yield from (dict(zip(columns, point, strict=True)) for point in zip(*columns.values(), strict=True))
