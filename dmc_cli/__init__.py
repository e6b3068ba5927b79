"""Turn volume data into quad meshes by dual marching cubes on NVIDIA Warp.

The data flow is the package. Whoever reads the folders in this order meets the method's steps in theirs; each
says in its `__init__.py` what it is for and in which order to read it:

    settings       every choice there is, with its default
    crops          which box of a volume's nodes is kept
    isovalue_choices  how an isovalue is chosen where no number is given
    methods        the methods of contouring, and what each takes
    volume_formats  the formats of volumes, what each looks like and takes
    mesh_formats   the formats of meshes, and what each holds
    requirements   what may be required of a mesh: words, and figures of the report beside numbers
    errors         every error that is raised on purpose
    notices        every warning's code, and what it means
    progress       who is told how far a run is
    stop           how work in threads is asked to stop
    threads        work in threads, as many as the system gives
    version        which version this is
    array_types    NumPy's arrays by what is in them
    system         what one operating system has and another lacks
    memory_limits  what this process may still take
    kept_property  properties that are evaluated once, without a lock
    printable      texts from outside without what a terminal would obey
    volume         values on a grid and where they lie in the world
    volume_io      volumes in files, one file or folder per format
    runtime        where kernels run, the threads that share a launch, memory
    bits           words of bits
    field          the grid and the function between its nodes
    mesh           connectivity, renumbering, invariants
    contouring     from a volume to a surface mesh, one folder per method
    parts          a volume's nodes prepared: what of it becomes the object
    processing     algorithms on a mesh: patterns, relaxation, remeshing
    measures       topology, quality, deviation, of any mesh
    report         what a run found, as JSON, and what is required of it
    files          outputs that are complete or not there at all
    mesh_io        meshes in files, one file or folder per format
    reproduction   the papers' tables, made again
    figures        the papers' figures of a comparison
    app            what a command does: convert, batch, measure
    cli            the command line, the only place that knows click

The names below are what other programs may rely on. They are imported when they are first used, so that
`import dmc_cli` and `dmc --help` stay light.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
