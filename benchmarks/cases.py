"""The volumes that the benchmarks run on, and where real ones are looked for."""

import os
from dataclasses import dataclass
from pathlib import Path

from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume
from dmc_cli.volume_io import read_volume

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("DMC_DATA", ROOT.parent / "shared" / "data"))
"""Real volumes that are too large for the repository; without them their cases are left out."""


@dataclass(frozen=True)
class Case:
    """One volume and the isovalue to cut it at."""

    name: str
    path: str
    isovalue: float
    read: ReadSettings

    def load(self) -> Volume | None:
        """Return the volume, or None where its file is absent."""
        if not self.path.startswith("synth:") and not Path(self.path).exists():
            return None
        return read_volume(self.path, self.read)


CASES = (
    Case("iWP 256", "synth:iwp:256", 0.0, ReadSettings()),
    Case("iWP 512", "synth:iwp:512", 0.0, ReadSettings()),
    Case("head CT, 300 HU", str(SHARED / "dicom_vhf_head.zip"), 300.0, ReadSettings()),
    Case(
        "micro-CT, 85",
        str(SHARED / "raw_microct_bone" / "trabecular_crop_128x128x128_uint8.raw"),
        85.0,
        ReadSettings(shape=(128, 128, 128), dtype="uint8"),
    ),
)
