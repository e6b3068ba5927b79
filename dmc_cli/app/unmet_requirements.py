"""Hold a mesh that is about to be written, or was measured, against what is required of it."""

from collections.abc import Iterable
from typing import Any

from dmc_cli.measures import kernel_modules, list_kernels
from dmc_cli.mesh import Mesh, connect, mesh_of_file
from dmc_cli.mesh_io import MeshFile
from dmc_cli.report import check_requirements
from dmc_cli.runtime import Device, load_kernels, select_device


def refuse_unmet(report: dict[str, Any], required: Iterable[str], mesh: MeshFile, device: Device) -> None:
    """Put the verdicts into a report, and raise RequirementError unless the mesh is everything that is asked.

    Args:
        report: A report with its measured sections.
        required: Words, sets and comparisons.
        mesh: The mesh that it is on; its faces are looked at only if something is not met.
        device: Where to look.
    """

    def connected() -> Mesh:
        load_kernels(device, [*kernel_modules(intersections=True), *list_kernels()])
        return connect(mesh_of_file(mesh, device))

    check_requirements(report, required, connected)


def device_of(report: dict[str, Any]) -> Device:
    """Return the device that a conversion ran on."""
    return select_device(report["settings"]["device"], report["settings"]["threads"])
