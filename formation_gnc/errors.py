"""Errors that a user can act on."""


class ConfigurationError(ValueError):
    """A value that cannot be flown: the message names the thing, the value and what is allowed.

    Raised while a run is being set up or a parameter changed, never in flight. A command that meets one
    prints its message as one line and ends with status 2.
    """


class DesignError(ConfigurationError):
    """A control law or filter that cannot be designed from its parameters."""
