"""Metrics, comparison, plots, reports."""
