"""Write and read the three formats of VTK that hold a surface: VTP and VTU, which are XML, and legacy VTK.

tables         what a mesh has, as arrays with names, in pieces
xml_writer     VTP (polygons) and VTU (cells of any kind)
legacy_writer  the plain format of before
cells          faces out of what files call polygons and cells
xml_arrays     arrays out of XML: text, base64, raw or compressed
xml_reader     pieces of XML files, joined
legacy_reader  arrays out of the plain format
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
