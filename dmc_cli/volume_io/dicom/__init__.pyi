# What the rest of `volume_io/` uses of this format.

from .reader import (
    dicom_entries as dicom_entries,
    dicom_survey as dicom_survey,
    dicom_volume as dicom_volume,
)
