"""Read DICOM: files, folders and zips to one volume; `reader` is the way in.

source       the files of a folder, a zip or a DICOMDIR
packed_slices  those of a folder that are packed one by one
effort       how much of all headers is read
deflated     a data set unpacked as it is read
wanted       the elements that images are asked for
flat         a plain header without pydicom
header       a file's header, with or without pydicom
elements     single elements of it
incomplete   files that never had an image, told from damaged ones
place        where an image lies
scale        what its values mean
storage      how the frames of a file are stored
increments   what the frames of a file are
makers       where makers keep that in elements of their own
csa          the header that Siemens keeps in an element
mosaic       slices that lie side by side in one image
labels       what tells apart images in one place
frames       the images of a file
order        slices without positions, in the order that is asked for
missing      slices that are missing, or may be
distances    gaps and copies among the slices' places
doubts       what contradicts the positions
mixed        slices whose values do not mean the same
identity     whose the slices are, and whether all of an object are there
geometry     the affine of a stack of them
philips      what Philips keeps of each frame, and its scale
stack        images of one series with the same size and orientation
segments     those of a segmentation object
segment_table  what it calls its segments
repetitions  times at each place, whether they belong together
factors      what differs at one place
directory    files that a DICOMDIR lists and that are missing
series       images sorted into stacks
codestream   what a compressed image says of itself
decoding     compressed pixel data, decoded
pixels       the values of a stack
reader       the volume of a stack
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
