"""Tests of the surface stage: the kernels beside the oracle, reference counts, invariants."""
