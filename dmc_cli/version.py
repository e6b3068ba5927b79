"""The version of the package, which is told here and nowhere else."""

VERSION = "0.1.0"
