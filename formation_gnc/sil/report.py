"""Report of a run in flight, apart from the plant: who reads it need not import that."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Report:
    """Where the run is: a word, figures by name, and what somebody should look at."""

    message: str
    figures: Mapping[str, float]
    troubles: tuple[str, ...] = ()
