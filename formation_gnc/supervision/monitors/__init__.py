"""Health monitors, one file each."""
