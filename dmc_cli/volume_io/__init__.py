"""Volumes in files, a format a file or a folder; `read.py` is the one way in. NumPy only, never Warp.

formats        the formats that there are, and where their readers are
layout, content, pair, within  what a file holds and which files belong to it
stream, decoding, values, unpacked_size  from bytes to one array, no larger than promised
raw, synthetic, numpy_file, metaimage, nifti, analyze, mgh, afni, parrec  formats of one file
slices         a volume from slices that have a scale each
nibabel_headers  what headers of nibabel's classes say of the values
minc/, nrrd/, tiff/, zarr/, dicom/  formats of a folder
volume_file    volumes written
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
