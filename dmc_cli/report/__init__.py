"""The report: what a run found, as JSON, and what is required of it."""
