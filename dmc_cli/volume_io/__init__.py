"""Read and write volumes, one file or folder per format; `read` is the one way in. NumPy only, never Warp.

read             a volume from a path, whatever its format
inputs           what an input is, and where once it is unpacked
stream           a stream, as a file
packed           files that are packed as a whole
content          a format told by the first bytes
unused_options   options that a format has no use for
folder           what a folder holds
image_kinds, slice_names, log_fields, scanner_log, image_stack  folders of images: kinds, order, texts
told_lengths, image_resolution, stack_spacing  what images tell of lengths, and which of it counts
left_out         how what is not used is named
library_errors   one message of whatever a library raises
zip_archive, tar_archive, unarchived  entries of an archive that can be what they claim; all of them, unpacked
within           which files belong to an input
pair, data_files  a header's data files
axes             what the axes of an array are called, and which volume of it is wanted
layout           where values lie in their files, and what they mean
units            lengths of units, in every spelling
lengths          lengths of which a file leaves the unit open
places           axes by their names and the places of their nodes, of HDF5 and Zarr
loose_lengths    lengths by attributes of no standard, of HDF5 and Zarr
decoding         bytes out of streams, packed or not
unpacked_size    what packed bytes unpack to, told beforehand
values           values of a layout, mapped or copied
sharp_fields     synthetic fields with sharp edges
raw, synthetic, numpy_file, metaimage  formats whose headers are read by us
nibabel_headers  what headers of nibabel's classes say of the values
nifti_labels     labels that an extension of a NIfTI header names
label_names      tables of labels, their names and colours
nifti_intents    what the fourth and fifth axis of NIfTI count
nifti, analyze, mgh, afni  formats whose headers nibabel reads
slices           a volume from slices that have a scale each
parrec_axes, parrec, minc/  formats with such slices
climate          scale and missing values by the Climate and Forecast conventions
hdf_path, hdf_heaps, hdf_storage, hdf5/  a dataset in a file: how it is named, stored and read
images           folders of PNG, BMP, JPEG and JPEG 2000
nrrd/, tiff/, zarr/, dicom/  formats that take several files of code
volume_file      volumes written
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
