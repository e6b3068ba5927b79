"""MINC files, written by hand: nibabel writes none."""

import numpy as np
from nibabel.externals.netcdf import netcdf_file

AXES = ("time", "zspace", "yspace", "xspace")


def netcdf(path, values, least, most, axes=AXES, along=(), **told):
    """Write MINC 1; values are big endian, and unsigned as their type says.

    Args:
        path: Where to.
        values: Along `axes`, of which as many as there are in `values` are taken from the end.
        least: image-min, along the axes `along`.
        most: image-max.
        axes: Names of the axes, the slowest first.
        along: Those along which least and most differ.
        told: Attributes of all axes in space, a tuple for x, y, z; valid_range.
    """
    axes = axes[-values.ndim :]
    file = netcdf_file(path, "w")
    for axis, size in zip(axes, values.shape, strict=True):
        file.createDimension(axis, size)
        variable = file.createVariable(axis, "i", ())
        for key, value in attributes(axis, told).items():
            setattr(variable, key, value)
    kind = {"i1": "b", "u1": "b", "i2": "h", "u2": "h", "i4": "i", "f4": "f", "f8": "d"}[values.dtype.str[1:]]
    image = file.createVariable("image", kind, axes)
    image[:] = values.view(values.dtype.str.replace("u", "i"))
    image.signtype = "unsigned" if values.dtype.kind == "u" else "signed__"
    if "valid_range" in told:
        image.valid_range = np.array(told["valid_range"], ">f8")
    for key, ends in (("image-min", least), ("image-max", most)):
        variable = file.createVariable(key, "d", along)
        variable.data[...] = ends
    file.close()
    return path


def hdf(path, values, least, most, axes=AXES, along=(), storage=None, **told):
    """Write MINC 2, as `netcdf`; `storage` goes to h5py with the image."""
    import h5py

    axes = axes[-values.ndim :]
    with h5py.File(path, "w") as file:
        for axis in axes:
            variable = file.create_dataset(f"minc-2.0/dimensions/{axis}", data=0)
            for key, value in attributes(axis, told).items():
                variable.attrs[key] = np.bytes_(value) if isinstance(value, str) else value
        folder = file.create_group("minc-2.0/image/0")
        image = folder.create_dataset("image", data=values, **storage or {})
        image.attrs["dimorder"] = np.bytes_(",".join(axes))
        if "valid_range" in told:
            image.attrs["valid_range"] = np.array(told["valid_range"], float)
        for key, ends in (("image-min", least), ("image-max", most)):
            dataset = folder.create_dataset(key, data=np.asarray(ends, float))
            if along:
                dataset.attrs["dimorder"] = np.bytes_(",".join(along))
    return path


def attributes(axis, told):
    """Return what an axis tells of itself."""
    found = {"spacing": told.get("spacing", "regular__")}
    if axis in AXES[1:]:
        place = "xyz".index(axis[0])
        for key in ("step", "start"):
            found[key] = float(told.get(key, (2.0, 3.0, 4.0))[place])
        if "units" in told:
            found["units"] = told["units"]
        found["direction_cosines"] = np.asarray(told.get("cosines", np.eye(3)), float)[place]
        found |= {"alignment": told["alignment"]} if "alignment" in told else {}
    return {key: value for key, value in found.items() if key not in told.get("without", ())}
