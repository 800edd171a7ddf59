"""What every benchmark gives."""

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Result:
    """Ours beside theirs, and the ratio that is to reach the goal."""

    name: str
    ours: float
    theirs: float
    unit: str
    ratio: float
    goal: str
    """What the ratio should be, such as ``>= 0.7``; empty for information only."""

    @property
    def holds(self) -> bool | None:
        """Whether the goal is reached; none without a goal."""
        if not self.goal:
            return None
        relation, number = self.goal.split()
        return self.ratio >= float(number) if relation == ">=" else self.ratio <= float(number)


def interleaved(measures: Sequence[Callable[[], float]], rounds: int) -> list[float]:
    """Medians of several measurements taken in turn: when the machine changes pace, it does for all."""
    figures: list[list[float]] = [[] for _ in measures]
    for _ in range(rounds):
        for measure, taken in zip(measures, figures, strict=True):
            taken.append(measure())
    return [statistics.median(taken) for taken in figures]
