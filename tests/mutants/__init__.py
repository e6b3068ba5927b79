"""Mutation testing: small faults are put into the package, one at a time, and some test has to notice.

Warp compiles the source text of kernels, so faults are put into the text, not into what Python made of it.
"""
