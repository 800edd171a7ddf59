"""Campaigns: many dispersed flights of a scenario, and one verdict. A case is a pure function of its number."""
