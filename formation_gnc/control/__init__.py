"""Control laws, their common interface and registry."""
