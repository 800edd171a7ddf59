"""Subcommands of `formation-gnc`, a module each: a docstring for the help, `add_arguments` and `run`."""

COMMANDS = (
    *("sil", "campaign", "new", "check", "keystore", "set", "design"),
    *("navigate", "replay", "compare", "report", "view", "export", "recover"),
)
