"""Errors that a user can act on: each message names the thing, the value and what is allowed."""

from collections.abc import Iterable
from difflib import get_close_matches


def nearest(name: str, known: Iterable[str]) -> str:
    """Hint for an unknown name: the nearest of the known ones, or all of them."""
    known = sorted(known)
    near = get_close_matches(name, known, n=1)
    return f"did you mean {near[0]}?" if near else f"known: {', '.join(known)}"


class ConfigurationError(ValueError):
    """A value that is not allowed; base of the errors of set-up.

    Raised while a run is set up or a parameter changed, never in flight. A command prints the message as one
    line and ends with status 2.
    """


class ParameterError(ConfigurationError):
    """A parameter that is unknown, missing, out of range or fixed in flight."""


class OrbitError(ConfigurationError):
    """Elements or a state that are no orbit, or one outside a model's validity."""


class DesignError(ConfigurationError):
    """A control law or filter that cannot be designed from its parameters."""


class BagError(ConfigurationError):
    """A bag that cannot be read or written, or lacks a topic or field that is asked for."""


class RecorderLostError(RuntimeError):
    """In flight: the recorder has died, and the run is to end with it."""


class ImpactError(RuntimeError):
    """In flight: a satellite has come down; its state lies below the Earth's surface, or is not finite."""
