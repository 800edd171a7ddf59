"""The way out: what a satellite flies in modes in which no law does."""

from typing import Protocol

from formation_gnc.mode_records import NO_FORCE, Mode
from formation_gnc.records import Estimate
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.types import Vector


class Evasion(Protocol):
    """A plan that is flown tick by tick until its mode ends."""

    @property
    def words(self) -> str:
        """What is flown and why, for people."""

    def force(self, time: int) -> Vector:
        """Force (3,) to hold over the tick that begins at a time (ns), Hill frame, N."""


class Coast:
    """No thrust."""

    words = "coasts"

    def force(self, time: int) -> Vector:
        """None."""
        return NO_FORCE


def plan_evasion(mode: Mode, time: int, estimate: Estimate | None, parameters: SupervisorParameters) -> Evasion:
    """The plan with which a mode begins.

    Args:
        mode: `avoid` or `safe`.
        time: of the first tick that is flown in it, ns.
        estimate: latest; None where there is none that can be trusted.
        parameters: of supervision.
    """
    return Coast()
