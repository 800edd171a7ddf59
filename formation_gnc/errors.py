"""Errors that a user can act on: each message names the thing, the value and what is allowed."""


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


class ImpactError(RuntimeError):
    """In flight: a satellite has come down; its state lies below the Earth's surface, or is not finite."""
