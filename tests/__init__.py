"""Tests: one fact a test, and its name says the fact."""
