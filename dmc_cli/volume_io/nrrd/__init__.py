"""NRRD; `reader.py` is the way in."""
