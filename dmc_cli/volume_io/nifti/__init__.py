"""NIfTI-1 and NIfTI-2; `reader.py` is the way in."""
