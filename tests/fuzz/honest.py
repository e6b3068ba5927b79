"""Small honest volumes of every format, as the files whose damage is tried."""

import bz2
import gzip

import nibabel as nib
import numpy as np
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so
from pydicom import uid
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

from tests.fuzz import honest_inputs, honest_meanings
from tests.volume_io.afni_files import afni_header
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.hdf5.big_data_viewer_files import CHANNELS, write_big_data_viewer, write_xml
from tests.volume_io.minc_files import hdf, netcdf
from tests.volume_io.par_files import par_header

VALUES = np.arange(6 * 7 * 8, dtype="<i2").reshape(6, 7, 8)


def make_nifti(folder):
    affine = np.array([[0, -1.5, 0.2, 5], [0.8, 0, 0, -7], [0, 0.3, 2.5, 9], [0, 0, 0, 1.0]])
    nib.save(nib.Nifti1Image(VALUES.T, affine), folder / "one.nii")
    nib.save(nib.Nifti1Image(VALUES.T, affine), folder / "one.nii.gz")
    nib.save(nib.Nifti2Image(VALUES.T.astype(">f4"), affine), folder / "two.nii")
    qform = nib.Nifti1Image(VALUES.T, None)
    qform.set_qform(affine, 1)
    nib.save(qform, folder / "qform.nii")
    return [folder / name for name in ("one.nii", "one.nii.gz", "two.nii", "qform.nii")]


def make_analyze(folder):
    nib.save(nib.Spm2AnalyzeImage(VALUES.T, np.diag([2, 3, 4, 1])), folder / "a.img")
    return [folder / "a.hdr"]


def make_nrrd(folder):
    header = (
        "NRRD0005\n# comment\ntype: short\ndimension: {}\nsizes: {}\nencoding: {}\nendian: little\n"
        "space: left-posterior-superior\nspace directions: {}(2,0,0) (0,3,0) (0,0,4)\nspace origin: (7,8,9)\n"
        'space units: "mm" "mm" "mm"\nkinds: {}domain domain domain\n{}\n'
    )
    data = VALUES.tobytes()
    packed = {
        "raw": data,
        "gzip": gzip.compress(data),
        "bzip2": bz2.compress(data),
        "hex": data.hex().encode(),
        "ascii": " ".join(map(str, VALUES.ravel())).encode(),
    }
    paths = []
    for encoding, content in packed.items():
        text = header.format(3, "8 7 6", encoding, "", "", "")
        paths.append(folder / f"{encoding}.nrrd")
        paths[-1].write_bytes(text.encode() + content)
    text = header.format(4, "2 4 7 6", "raw", "none ", "list ", "line skip: 0\nbyte skip: -1\n")
    paths.append(folder / "four.nrrd")
    paths[-1].write_bytes(text.encode() + data)
    for k, plane in enumerate(VALUES):
        (folder / f"s{k}.raw").write_bytes(plane.tobytes())
    paths.append(folder / "pattern.nhdr")
    paths[-1].write_text(header.format(3, "8 7 6", "raw", "", "", "data file: s%d.raw 0 5 1\n"))
    return paths


def make_meta(folder):
    image = sitk.GetImageFromArray(VALUES)
    image.SetSpacing((1, 2, 3))
    sitk.WriteImage(image, str(folder / "a.mha"), False)
    sitk.WriteImage(image, str(folder / "b.mha"), True)
    sitk.WriteImage(image, str(folder / "c.mhd"), False)
    return [folder / name for name in ("a.mha", "b.mha", "c.mhd")]


def make_raw(folder):
    (folder / "a.raw").write_bytes(VALUES.tobytes())
    (folder / "a.raw.gz").write_bytes(gzip.compress(VALUES.tobytes()))
    return [folder / "a.raw", folder / "a.raw.gz"]


def make_numpy(folder):
    np.save(folder / "a.npy", VALUES)
    np.save(folder / "f.npy", np.asfortranarray(VALUES))
    np.savez_compressed(folder / "a.npz", one=VALUES, two=VALUES)
    np.savez(folder / "b.npz", VALUES)
    np.save(folder / "five.npy", VALUES[None, None, ..., None])
    np.savez_compressed(folder / "four.npz", np.stack([VALUES, VALUES]))
    return [folder / name for name in ("a.npy", "f.npy", "a.npz", "b.npz", "five.npy", "four.npz")]


def make_tiff(folder):
    import tifffile

    from tests.volume_io.tiff.programs import write_fei, write_geotiff, write_lsm, write_stk

    told = {"axes": "ZYX", "spacing": 2.0, "unit": "um"}
    tifffile.imwrite(folder / "a.tif", VALUES.view("<u2"), imagej=True, metadata=told)
    tifffile.imwrite(folder / "b.tif", VALUES, photometric="minisblack", compression="zlib")
    tifffile.imwrite(folder / "c.ome.tif", VALUES, metadata={"axes": "ZYX", "PhysicalSizeX": 0.5})
    several = np.stack([VALUES, VALUES]).view("<u2")
    tifffile.imwrite(folder / "d.tif", several.swapaxes(0, 1), imagej=True, metadata={"axes": "ZCYX"})
    told = {"axes": "TZYX", "Channel": {"Name": ["DAPI"]}}
    tifffile.imwrite(folder / "e.ome.tif", several, metadata=told, compression="zlib")
    tifffile.imwrite(folder / "f.tif", VALUES > 0, photometric="minisblack", metadata={"axes": "YZX"})
    write_lsm(folder / "g.tif", VALUES, (1e-7, 2e-7, 5e-7))
    write_stk(folder / "h.tif", VALUES, [(3, 2)] * len(VALUES))
    write_fei(folder / "i.tif", VALUES)
    write_geotiff(folder / "j.tif", VALUES)
    return sorted(folder.glob("*.tif"))


def make_dicom(folder):
    """A folder a syntax, of which one slice is damaged."""
    paths = []
    syntaxes = {
        "explicit": uid.ExplicitVRLittleEndian,
        "implicit": uid.ImplicitVRLittleEndian,
        "big": uid.ExplicitVRBigEndian,
        "deflated": uid.DeflatedExplicitVRLittleEndian,
        "rle": uid.RLELossless,
    }
    for name, syntax in syntaxes.items():
        for k, position in enumerate(axial(3)):
            values = plane_values(k, ">i2" if name == "big" else "<i2", (8, 8))
            plain = uid.ExplicitVRLittleEndian if name == "rle" else syntax
            dataset = make_slice(position, k, values=values, syntax=plain, PixelPaddingValue=-9)
            if name == "rle":
                dataset.compress(syntax)
            path = save(dataset, folder / name / f"{k}")
        paths.append(path)
    return paths


def make_compressed(folder):
    """A folder a codec of the extra packages, of which one slice is damaged."""
    paths = []
    for syntax in (uid.JPEG2000Lossless, uid.JPEGLSLossless):
        for k, position in enumerate(axial(3)):
            dataset = make_slice(position, k, values=plane_values(k, "<i2", (64, 64)))
            dataset.compress(syntax)
            path = save(dataset, folder / syntax.keyword / f"{k}")
        paths.append(path)
    return paths


def make_enhanced(folder):
    """One file with many frames."""
    values = np.array([plane_values(k, "<i2", (8, 8)) for k in range(3)])
    plain = {"ImagePositionPatient": None, "ImageOrientationPatient": None, "PixelSpacing": None}
    dataset = make_slice((0, 0, 0), 0, values=values[0], **plain)
    dataset.NumberOfFrames = 3
    dataset.PixelData = values.tobytes()
    shared, orientation, measures = Dataset(), Dataset(), Dataset()
    orientation.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    measures.PixelSpacing = [1, 2]
    shared.PlaneOrientationSequence, shared.PixelMeasuresSequence = (
        Sequence([orientation]),
        Sequence([measures]),
    )
    dataset.SharedFunctionalGroupsSequence = Sequence([shared])
    groups = []
    for k in range(3):
        group, position = Dataset(), Dataset()
        position.ImagePositionPatient = [0, 0, 3 * k]
        group.PlanePositionSequence = Sequence([position])
        groups.append(group)
    dataset.PerFrameFunctionalGroupsSequence = Sequence(groups)
    return [save(dataset, folder / "enhanced.dcm")]


def make_zarr(folder):
    """Arrays and an OME image, in both versions of the format; every file of them is damaged in turn."""
    import zarr

    scale = {"coordinateTransformations": [{"type": "scale", "scale": [4.0, 3.0, 2.0]}]}
    axes = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
    for version in (2, 3):
        stores = {f"array{version}.zarr": ""}
        image = zarr.open_group(folder / f"image{version}.zarr", mode="w", zarr_format=version)
        found = {"multiscales": [{"axes": axes, "datasets": [{"path": "0", **scale}], "version": "0.4"}]}
        image.attrs.update({"ome": found} if version == 3 else found)
        stores[f"image{version}.zarr"] = "0"
        for store, inner in stores.items():
            array = zarr.create_array(
                folder / store / inner, shape=VALUES.shape, chunks=(3, 4, 8), dtype="i2", zarr_format=version
            )
            array[...] = VALUES
    layout = folder / "raw.zarr"
    zarr.open_group(layout, mode="w", zarr_format=2).attrs.update({"bioformats2raw.layout": 3})
    image = zarr.open_group(layout / "0", mode="w", zarr_format=2)
    told = {"axes": ["z", "c", "y", "x"], "datasets": [{"path": "0"}], "version": "0.3"}
    image.attrs.update({"multiscales": [told], "omero": {"channels": [{"label": "DAPI"}]}})
    options = {"chunks": (3, 1, 4, 8), "dtype": "i2", "zarr_format": 2}
    array = zarr.create_array(layout / "0" / "0", shape=(6, 1, 7, 8), **options)
    array[...] = VALUES[:, None]
    _with_places(folder / "places.zarr", zarr)
    return sorted(path for path in folder.rglob("*") if path.is_file())


def _with_places(path, zarr):
    """As xarray writes it, with lengths by N5's habit, too."""
    group = zarr.open_group(path, mode="w", zarr_format=2)
    group.attrs.update(pixelResolution={"dimensions": [2.0, 3.0, 4.0], "unit": "um"})
    told = {
        "_ARRAY_DIMENSIONS": ["z", "y", "x"],
        "_FillValue": 7,
        "valid_range": [0, 90],
        "scale_factor": 0.5,
    }
    zarr.create_array(path / "ct", data=VALUES, chunks=(3, 4, 8), zarr_format=2, attributes=told)
    for axis, size in zip("zyx", VALUES.shape, strict=True):
        attributes = {"_ARRAY_DIMENSIONS": [axis], "units": "um", "axis": axis.upper()}
        zarr.create_array(path / axis, data=np.arange(size) * 0.5, zarr_format=2, attributes=attributes)


def make_mgh(folder):
    affine = np.array([[0.0, -1.5, 0.2, 5], [0.8, 0, 0, -7], [0, 0.3, 2.5, 9], [0, 0, 0, 1]])
    content = nib.MGHImage(VALUES.T, affine).to_bytes()
    (folder / "a.mgh").write_bytes(content)
    (folder / "a.mgz").write_bytes(gzip.compress(content))
    return [folder / "a.mgh", folder / "a.mgz"]


def make_afni(folder):
    (folder / "a+orig.HEAD").write_text(afni_header(VALUES.shape[::-1]))
    (folder / "a+orig.BRIK").write_bytes(VALUES.astype("<i2").tobytes())
    return [folder / "a+orig.HEAD", folder / "a+orig.BRIK"]


def make_parrec(folder):
    nx, ny, nz = VALUES.shape[::-1]
    scales = [[[1 + k, k] for k in range(nz)]]
    (folder / "a.PAR").write_text(par_header((nx, ny, nz), scales))
    (folder / "a.REC").write_bytes(VALUES.astype("<u2").tobytes())
    return [folder / "a.PAR", folder / "a.REC"]


def make_minc(folder):
    ends = (np.arange(6.0), np.arange(6.0) + 9)
    netcdf(folder / "one.mnc", VALUES, *ends, along=("zspace",))
    hdf(folder / "two.mnc", VALUES, *ends, along=("zspace",))
    packed = {"chunks": (2, 7, 8), "compression": "gzip", "shuffle": True}
    hdf(folder / "packed.mnc", VALUES, 0.0, 9.0, storage=packed)
    return [folder / "one.mnc", folder / "two.mnc", folder / "packed.mnc"]


def make_images(folder):
    """A folder a kind, with a scanner's log; the log and a slice of each are damaged."""
    from openjpeg.utils import encode_array
    from PIL import Image

    paths = []
    values = VALUES.astype("u2")
    for suffix in (".png", ".bmp", ".jp2"):
        inside = folder / suffix[1:]
        inside.mkdir()
        for k, plane in enumerate(values):
            path = inside / f"rec{k:04d}{suffix}"
            if suffix == ".jp2":
                path.write_bytes(encode_array(np.tile(plane, (8, 8)), bits_stored=16, codec_format=1))
            else:
                Image.fromarray(plane if suffix == ".png" else plane.astype("u1")).save(path)
        paths.append(path)
    log = paths[0].parent / "rec.log"
    log.write_text(
        "[Reconstruction]\nSections Count=6\nResult Image Width (pixels)=8\nPixel Size (um)=17.5\n"
    )
    return [*paths, log]


def make_hdf5(folder):
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file.create_dataset("entry/data", data=VALUES, chunks=(3, 7, 8), compression="gzip")
    with h5py.File(folder / "b.nxs", "w") as file:
        file.attrs["default"] = "entry"
        data = file.create_group("entry")
        data.attrs.update(signal="data", axes=["z", "y", "x"])
        data["data"] = VALUES
        for axis, size in zip("zyx", VALUES.shape, strict=True):
            data[axis] = np.arange(size) * 0.5
            data[axis].attrs["units"] = "um"
    write_big_data_viewer(folder / "c.h5")
    write_xml(folder / "c.xml", CHANNELS[:1], file="c.h5")
    return [folder / name for name in ("a.h5", "b.nxs", "c.h5", "c.xml")]


HONEST = {
    "afni": make_afni,
    "analyze": make_analyze,
    "compressed": make_compressed,
    "dicom": make_dicom,
    "dicom_makers": honest_meanings.make_makers,
    "dicom_meanings": honest_meanings.make_dicom,
    "enhanced": make_enhanced,
    "hdf5": make_hdf5,
    "hdf5_meanings": honest_meanings.make_hdf5,
    "images": make_images,
    "meta": make_meta,
    "mgh": make_mgh,
    "minc": make_minc,
    "nifti": make_nifti,
    "nrrd": make_nrrd,
    "numpy": make_numpy,
    "packed": honest_inputs.make_packed,
    "packed_pairs": honest_inputs.make_packed_pairs,
    "packed_slices": honest_inputs.make_packed_slices,
    "parrec": make_parrec,
    "raw": make_raw,
    "tar": honest_inputs.make_tar,
    "tiff": make_tiff,
    "tiff_logs": honest_meanings.make_logs,
    "zarr": make_zarr,
    "zip": honest_inputs.make_zip,
}
"""Name of a reader to what makes its honest files in a folder; each file is damaged in turn."""
