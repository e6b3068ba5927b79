"""TIFF, OME-TIFF and ImageJ; `reader.py` is the way in."""
