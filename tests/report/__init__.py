"""Tests of the measures and the report."""
