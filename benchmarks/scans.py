"""The real volumes of shared data that the methods are compared on, with isovalues, and those left out.

A path is in `cases.SHARED`. Isovalues are those of the data's catalogue where it names some.
"""

from dataclasses import dataclass, field

from cases import SHARED

from dmc_cli.settings import ReadSettings


@dataclass(frozen=True)
class Scan:
    """A volume and what to cut it at.

    Attributes:
        name: Its folder, and the file where the folder has several.
        path: Its file or folder in `SHARED`.
        isovalues: In physical values.
        read: How it is read.
    """

    name: str
    path: str
    isovalues: tuple[float, ...]
    read: ReadSettings = field(default_factory=ReadSettings)

    @property
    def file(self) -> str:
        """Return where it is."""
        return str(SHARED / self.path)


def raw(x: int, y: int, z: int) -> ReadSettings:
    """Return how a raw file of bytes is read."""
    return ReadSettings(shape=(x, y, z), dtype="uint8")


SCANS = (
    Scan("analyze_mni", "analyze_mni/avg152T1.hdr.gz", (50 * 1715.0,)),
    Scan("dicom_compressed_4slices", "dicom_compressed_4slices/uncompressed", (60.0,)),
    Scan("dicom_emri_syntaxes", "dicom_emri_syntaxes/emri_small.dcm", (150.0,)),
    Scan("dicom_enhanced_nema", "dicom_enhanced_nema/BRTUM014", (190.0,)),
    Scan("dicom_enhanced_xa30", "dicom_enhanced_xa30", (400.0,)),
    Scan("dicom_ge_tilt", "dicom_ge_tilt", (-300.0, 300.0), ReadSettings(slice_gaps="keep")),
    Scan("dicom_mr_pd_axial", "dicom_mr_pd_axial", (235.0,)),
    Scan("dicom_vhf_head", "dicom_vhf_head.zip", (-300.0, 300.0)),
    Scan("meta_aorta", "meta_aorta/aorta.mha", (1000.0,)),
    Scan("nifti_bonsai", "nifti_bonsai/bonsai.nii.gz", (40.0, 150.0)),
    Scan("nifti_engine", "nifti_engine/engine.nii.gz", (75.0, 180.0)),
    Scan("nifti_mni_endian, avg152T1", "nifti_mni_endian/avg152T1_LR_nifti.nii", (50.0, 150.0)),
    Scan("nifti_mni_endian, zstat", "nifti_mni_endian/big.nii.gz", (2.3,)),
    Scan("nifti_mni_endian, air", "nifti_mni_endian/air.hdr.gz", (45.0,)),
    Scan("nifti_mr_seg3d", "nifti_mr_seg3d/MR.nii.gz", (60.0, 250.0)),
    Scan("nifti_small_odd, anatomical", "nifti_small_odd/anatomical.nii", (10000.0,)),
    Scan("nifti_small_odd, example4d", "nifti_small_odd/example4d.nii.gz", (300.0,), ReadSettings(time="0")),
    Scan("nifti_small_odd, Kmeans", "nifti_small_odd/KmeansTest_T1UCharRaw.nii.gz", (100.0,)),
    Scan("nifti_small_odd, scct", "nifti_small_odd/scct.nii", (1200.0,)),
    Scan("nifti_small_odd, t1w", "nifti_small_odd/t1w.nii.gz", (350.0,)),
    Scan("nifti_small_odd, t2", "nifti_small_odd/t2.nii.gz", (400.0,)),
    Scan("nifti_stroke_t1", "nifti_stroke_t1/T1.nii.gz", (60.0, 150.0)),
    Scan("nrrd_avf_mra", "nrrd_avf_mra/avf_float_32.nrrd", (800.0,)),
    Scan("nrrd_brain1", "nrrd_brain1/brain1_image.nrrd", (200.0, 900.0)),
    Scan("nrrd_brain1, label", "nrrd_brain1/brain1_label.nrrd", (0.5,)),
    Scan("nrrd_breast1", "nrrd_breast1/breast1_image.nrrd", (93.0,)),
    Scan("nrrd_fetal_t2", "nrrd_fetal_t2/template_T2.nrrd", (150.0, 400.0)),
    Scan("nrrd_skull_mask", "nrrd_skull_mask/Skull.nrrd", (0.5,)),
    Scan("nrrd_tooth", "nrrd_tooth/tooth.nhdr", (500.0, 1000.0)),
    Scan("raw_engine", "raw_engine/engine_256x256x110_uint8.raw", (75.0, 180.0), raw(256, 256, 110)),
    Scan("raw_headmr_meta", "raw_headmr_meta/HeadMRVolume.mha", (30.0,)),
    Scan("raw_headsq_slices", "raw_headsq_slices/quarter.nhdr", (500.0, 1150.0)),
    Scan(
        "raw_microct_bone",
        "raw_microct_bone/trabecular_crop_128x128x128_uint8.raw",
        (85.0, 110.0),
        raw(128, 128, 128),
    ),
)
"""The volumes, all of them whole: none is larger than 61 million nodes."""

LEFT_OUT = (
    "dicom_nonimage_mix: two slices beside structures and plans, no volume of its own",
    "nrrd_encodings_tiny: format samples of 5 x 6 x 7 nodes and a ball of 30³, no scans",
    "further files of a folder that hold the same values in another format, byte order or compression",
    "nifti_small_odd, example_nifti2 and functional: 12 and 3 slices of a few cells",
    "nrrd_breast1, label: as that of nrrd_brain1",
)
"""What is not there, and why."""
