"""DICOM: files, folders and zips to one volume; `reader.py` is the way in."""
