"""Read and write volumes, one file or folder per format; `read` is the one way in. NumPy only, never Warp.

read             a volume from a path, whatever its format
stream           standard input, as a file
content          a format told by the first bytes
unused_options   options that a format has no use for
within           which files belong to an input
pair, data_files  a header's data files
axes             what the axes of an array are called, and which volume of it is wanted
layout           where values lie in their files, and what they mean
units            lengths of units, in every spelling
lengths          lengths of which a file leaves the unit open
decoding         bytes out of streams, packed or not
unpacked_size    what packed bytes unpack to, told beforehand
values           values of a layout, mapped or copied
raw, synthetic, numpy_file, metaimage  formats whose headers are read by us
nibabel_headers  what headers of nibabel's classes say of the values
nifti, analyze, mgh, afni  formats whose headers nibabel reads
slices           a volume from slices that have a scale each
parrec, minc/    formats with such slices
nrrd/, tiff/, zarr/, dicom/  formats that take several files of code
volume_file      volumes written
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
