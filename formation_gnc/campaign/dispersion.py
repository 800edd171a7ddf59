"""Dispersions: what a campaign draws for each case, each from a random stream of its own name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args, get_origin

from formation_gnc.campaign.distributions import WITHIN, Distribution, HillNormal, distribution_of
from formation_gnc.errors import ConfigurationError, ParameterError, nearest
from formation_gnc.parameters import Leaf, to_json
from formation_gnc.plant.faults.registry import FAULTS
from formation_gnc.randomness import generator

AS = "as"
"""Key beside a distribution that says what is done with what is drawn."""

MODES = ("value", "offset", "factor")
"""A draw is the parameter's value, is added to it, or multiplies it."""

Address = tuple[str, str]
"""Full node name and dotted name of a parameter."""


def stream(seed: int, case: int, name: str) -> Any:
    """Random numbers of one dispersion in one case; they depend on nothing else."""
    return generator(seed, f"case {case}/{name}")


@dataclass(frozen=True)
class Dispersion:
    """A parameter that differs from case to case.

    Attributes:
        name: as in the file.
        distribution: of the value, or of each value of a list.
        mode: one of MODES.
    """

    name: str
    distribution: Distribution
    mode: str

    def value(self, seed: int, case: int, base: Any) -> Any:
        """Value of the parameter in a case, given that of the scenario."""
        is_list = isinstance(base, tuple)
        drawn = self.distribution.draw(stream(seed, case, self.name), len(base) if is_list else 1)
        values = [self._applied(one, other) for one, other in zip(base if is_list else [base], drawn, strict=True)]
        return values if is_list else values[0]

    def _applied(self, base: Any, drawn: Any) -> Any:
        if self.mode == "value":
            return drawn
        return base + drawn if self.mode == "offset" else base * drawn

    def check(self, leaf: Leaf, base: Any) -> None:
        """Raise ConfigurationError if a value may be drawn that the parameter cannot have."""
        kind = get_args(leaf.type)[0] if get_origin(leaf.type) is tuple else leaf.type
        if self.mode != "value" and kind not in (int, float):
            raise ConfigurationError(
                f"dispersion {self.name}: {AS}: {self.mode} is not allowed; {leaf.name} is no number"
            )
        for extreme in self.distribution.support():
            values = [self._applied(one, extreme) for one in (base if isinstance(base, tuple) else [base])]
            try:
                leaf.check(values if isinstance(base, tuple) else values[0])
            except ParameterError as error:
                hint = "" if isinstance(extreme, str | bool) else f"; {WITHIN}: [LOW, HIGH] truncates the distribution"
                raise ConfigurationError(f"dispersion {self.name}: leaves the range: {error}{hint}") from None
        if isinstance(self.distribution, HillNormal):
            self.distribution.draw(stream(0, 0, self.name), len(base) if isinstance(base, tuple) else 1)


def dispersion_of(name: str, spec: Any) -> Dispersion:
    """Dispersion from the file's form: a distribution, and what is done with what is drawn.

    Raises:
        ConfigurationError: it is none.
    """
    spec = dict(spec) if isinstance(spec, dict) else spec
    default = "offset" if isinstance(spec, dict) and "hill_normal" in spec else "value"
    mode = spec.pop(AS, default) if isinstance(spec, dict) else default
    if mode not in MODES:
        raise ConfigurationError(
            f"dispersion {name}: {AS}: {mode!r} is not allowed; it must be one of {', '.join(MODES)}"
        )
    try:
        return Dispersion(name, distribution_of(spec), mode)
    except ConfigurationError as error:
        raise ConfigurationError(f"dispersion {name}: {error}") from None


@dataclass(frozen=True)
class DispersedFault:
    """A fault of the plant with fields that differ from case to case, or that not every case has.

    Attributes:
        name: in the file.
        fault: name of the fault in the registry.
        fixed: fields that all cases have alike.
        drawn: distributions of the other fields.
        probability: of a case to have the fault.
    """

    name: str
    fault: str
    fixed: Mapping[str, Any]
    drawn: Mapping[str, Distribution]
    probability: float

    def fields(self, seed: int, case: int) -> dict[str, Any] | None:
        """Drawn fields in a case; None where the fault does not happen."""
        happens = stream(seed, case, f"faults.{self.name}").random() < self.probability
        if not happens:
            return None
        return {name: self._drawn(seed, case, name, each) for name, each in self.drawn.items()}

    def _drawn(self, seed: int, case: int, field: str, distribution: Distribution) -> Any:
        count = self.count(field)
        values = distribution.draw(stream(seed, case, f"faults.{self.name}.{field}"), count or 1)
        return values if count else values[0]

    def count(self, field: str) -> int:
        """Values of a field that is a list of fixed length; 0 for a single value."""
        for leaf in _fault_leaves(self.fault):
            if leaf.name == field and get_origin(leaf.type) is tuple:
                return leaf.limits.length or 1
        return 0

    def entry(self, seed: int, case: int) -> str | None:
        """Entry of the plant's `faults` in a case; None where the fault does not happen."""
        fields = self.fields(seed, case)
        if fields is None:
            return None
        values = {"fault": self.fault, **self.fixed, **fields}
        return "{" + ", ".join(f"{name}: {_yaml(value)}" for name, value in values.items()) + "}"


def _yaml(value: Any) -> str:
    return value if isinstance(value, str) else to_json(value)


def _fault_leaves(fault: str) -> list[Leaf]:
    from formation_gnc.parameters import leaves

    return list(leaves(FAULTS[fault], {}))


def fault_of(name: str, spec: Any) -> DispersedFault:
    """Dispersed fault from the file's form: the fields of the fault, each a value or a distribution, and `probability`.

    Raises:
        ConfigurationError: an unknown fault or field, a distribution that leaves a field's range, or nothing that
            differs from case to case.
    """
    if not isinstance(spec, dict) or not isinstance(spec.get("fault"), str):
        raise ConfigurationError(f"fault {name}: is not allowed; it must have `fault` and the fields of that fault")
    fields = dict(spec)
    kind, probability = fields.pop("fault"), fields.pop("probability", 1.0)
    if kind not in FAULTS:
        raise ConfigurationError(f"fault {name}: {kind!r} is unknown; {nearest(kind, FAULTS)}")
    if isinstance(probability, bool) or not isinstance(probability, int | float) or not 0.0 < probability <= 1.0:
        raise ConfigurationError(
            f"fault {name}: probability: {probability!r} is not allowed; it must be above 0 and at most 1"
        )
    known = {leaf.name: leaf for leaf in _fault_leaves(kind)}
    drawn: dict[str, Distribution] = {}
    for field, value in list(fields.items()):
        if field not in known:
            raise ConfigurationError(f"fault {name}: {field} is no field of {kind}; {nearest(field, known)}")
        if isinstance(value, dict):
            drawn[field] = dispersion_of(f"faults.{name}.{field}", fields.pop(field)).distribution
            _check_range(f"faults.{name}.{field}", drawn[field], known[field])
    if not drawn and probability == 1.0:
        raise ConfigurationError(f"fault {name}: is the same in every case; it belongs into the scenario's faults")
    return DispersedFault(name, kind, fields, drawn, float(probability))


def _check_range(name: str, distribution: Distribution, leaf: Leaf) -> None:
    is_list = get_origin(leaf.type) is tuple
    base = (0.0,) * (leaf.limits.length or 1) if is_list else 0.0
    Dispersion(name, distribution, "value").check(leaf, base)


def flat(name: str, value: Any) -> dict[str, Any]:
    """Columns of a value: of a list, one for each of its values."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return {f"{name}[{number}]": each for number, each in enumerate(value)}
    return {name: value}
