"""Write files as BigDataViewer exports them, and the XML beside them."""

from itertools import product

import numpy as np

from tests.volume_io.reading import counting

VALUES = counting((4, 5, 6), "<i2")
CALIBRATION = "0.5 0 0 0 0 0.5 0 0 0 0 2 0"


def value(time, setup):
    return VALUES + 1000 * time + 100 * setup


def write_big_data_viewer(path, times=(0,), setups=1, shapes=None):
    """As BigDataViewer exports it: unsigned values as signed ones, a smaller copy of each view."""
    import h5py

    with h5py.File(path, "w") as file:
        for setup in range(setups):
            file[f"s{setup:02d}/resolutions"] = np.array([[1.0, 1, 1], [2, 2, 1]])
            file[f"s{setup:02d}/subdivisions"] = np.array([[2, 2, 2], [2, 2, 2]])
        for time, setup in product(times, range(setups)):
            values = value(time, setup)[: (shapes or {}).get(setup)].astype("<u2").view("<i2")
            for level, each in enumerate((values, values[:, ::2, ::2])):
                place = f"t{time:05d}/s{setup:02d}/{level}/cells"
                file.create_dataset(place, data=each, chunks=(2, 2, 2), compression="gzip")
    return path


def write_xml(
    path, setups, times=1, unit="um", size="0.5 0.5 2", affines=(CALIBRATION,), names="", file="a.h5"
):
    """`setups` are the elements of each one's attributes."""
    views = "".join(
        f"<ViewSetup><id>{n}</id><name>view {n}</name><size>6 5 4</size><voxelSize><unit>{unit}</unit>"
        f"<size>{size}</size></voxelSize><attributes>{attributes}</attributes></ViewSetup>"
        for n, attributes in enumerate(setups)
    )
    steps = "".join(
        f'<ViewTransform type="affine"><affine>{each}</affine></ViewTransform>' for each in affines
    )
    registrations = "".join(
        f'<ViewRegistration timepoint="{t}" setup="{s}">{steps}</ViewRegistration>'
        for t, s in product(range(times), range(len(setups)))
    )
    path.write_text(
        '<?xml version="1.0" encoding="UTF-8"?>\n<SpimData version="0.2">'
        '<BasePath type="relative">.</BasePath><SequenceDescription>'
        f'<ImageLoader format="bdv.hdf5"><hdf5 type="relative">{file}</hdf5></ImageLoader>'
        f"<ViewSetups>{views}{names}</ViewSetups></SequenceDescription>"
        f"<ViewRegistrations>{registrations}</ViewRegistrations></SpimData>"
    )
    return path


CHANNELS = [f"<channel>{n}</channel><angle>0</angle>" for n in range(2)]
