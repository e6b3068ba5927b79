"""Tests of the readers, beside independent ones."""
