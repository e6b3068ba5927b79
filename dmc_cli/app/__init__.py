"""Run the commands' work without the command line.

read_ahead     the input is read while kernels are loaded
memory_budget  the forecast that is held against a budget
file_keys, overlaps  no output is an input or another output
kept_volume    a volume that several conversions share
preparation    what the settings leave open until a volume is read
no_surface     why there is no surface, and where there are some
mesh_values    what stands beside vertices and faces in a file
fine_mesh      the mesh before quads were taken away, and how far another may be from it
size           what became of the size that was asked for
mesh_stages    simplification, remeshing, decimation, relaxation, timed
conversion     the table of contents: one call per stage
unmet_requirements  what is required of a mesh, and the faces that are not so
marked_faces   a mesh that was measured, with what each face is to blame for
writing        what is written of it
several        one input at several isovalues
label_choice, label_parts  layers of labels, and the part of each that is wanted
label_files, label_surfaces  files and meshes of labels
label_sizes    shells of the size one wants
label_report, label_writing  what is told of them, and written
label_conversion  a label map to the surfaces of its labels
measurement    a mesh file measured
reworked_mesh  what is done to its mesh: on the surface of a volume, or on its own
rework         a mesh file made into another one
closed_tunnels  tunnels of the trilinear surface that a mesh does not have
comparison     methods beside each other
object_components  the components of the nodes above an isovalue
spectrum       what surfaces a volume has, over the range of its values
output_folders  folders of outputs, made and, where nothing is in them, taken away
outcomes       how each of many conversions ended
batch          many conversions, side by side
junit          their outcomes for continuous integration
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
