"""AFNI's headers, written by hand: nibabel writes none."""


def afni_header(shape, kind=1, factors=(0.0,), order="LSB_FIRST", steps=(2.0, 3.0, 4.0), **changes):
    """Return a .HEAD for as many sub-bricks as there are factors; a change of None leaves one out."""
    dx, dy, dz = steps
    attributes = {
        "DATASET_RANK": (3, len(factors), 0, 0),
        "DATASET_DIMENSIONS": (*shape, 0, 0),
        "TYPESTRING": "3DIM_HEAD_ANAT",
        "BYTEORDER_STRING": order,
        "BRICK_TYPES": (kind,) * len(factors),
        "BRICK_FLOAT_FACS": tuple(map(float, factors)),
        "DELTA": steps,
        "IJK_TO_DICOM_REAL": (dx, 0.0, 0.0, -5.0, 0.0, dy, 0.0, 7.0, 0.0, 0.0, dz, 9.0),
    } | changes
    texts = []
    for name, value in attributes.items():
        if value is None:
            continue
        if isinstance(value, str):
            kind_name, count, text = "string", len(value) + 1, f"'{value}~"
        else:
            kind_name = "float" if isinstance(value[0], float) else "integer"
            count, text = len(value), " ".join(map(repr, value))
        texts.append(f"type = {kind_name}-attribute\nname = {name}\ncount = {count}\n{text}\n")
    return "\n" + "\n".join(texts)
