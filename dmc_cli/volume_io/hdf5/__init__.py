"""Read datasets of HDF5 and NeXus files, and images that ITK wrote as HDF5; `reader` is the way in.

links            links in a file, attributes that are texts
dataset          which dataset of a file is meant
stored           what is known of it, and of several that make one image
named_axes       what a file calls the axes of its dataset
nexus            scales of NeXus' fields, and transformations
imaris           what an Imaris file says of a dataset
geometry         what a file says of its dataset's axes, lengths and units
spim_data        what the XML beside a BigDataViewer file says
big_data_viewer  the images of such a file
images           the images of any file
reader           the volume of one
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
