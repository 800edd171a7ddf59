"""Parameters that a bag's metadata say its nodes started with."""

from collections.abc import Mapping
from typing import Any

from formation_gnc.common import FIRST_EPOCH, LAST_EPOCH
from formation_gnc.flight.graph import PLANT
from formation_gnc.parameters import from_json
from formation_gnc.recording.provenance import parameters_record


def recorded_number(metadata: Mapping[str, Mapping[str, Any]], node: str, name: str) -> float | None:
    """A node's parameter at its start; None where the bag does not have it as a number."""
    try:
        return float(from_json(metadata[parameters_record(node)][name]))
    except (KeyError, ValueError, TypeError):
        return None


def epoch_of(metadata: Mapping[str, Mapping[str, Any]]) -> float | None:
    """Time zero of a run, s of Terrestrial Time since J2000.0; None where the bag does not say."""
    epoch = recorded_number(metadata, PLANT, "epoch")
    return epoch if epoch is not None and FIRST_EPOCH <= epoch <= LAST_EPOCH else None
