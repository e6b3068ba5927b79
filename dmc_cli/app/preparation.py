"""Settle what a conversion leaves open until its volume is read: the isovalue, and which values are cut.

box of nodes -> table cut -> isovalue -> values of a band -> other distances -> smoothed
-> opened, closed -> components kept -> cavities filled
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from dmc_cli.app.memory_budget import held_bytes, reserve_beside
from dmc_cli.field import DeviceVolume, upload_volume
from dmc_cli.runtime import Device
from dmc_cli.settings import ConvertSettings
from dmc_cli.volume import Chosen, Suggestions, Volume


@dataclass(frozen=True)
class Prepared:
    """What is contoured.

    Attributes:
        settings: The conversion's, its isovalue a number.
        on_device: The volume to contour.
        source: The volume as it was read.
        choice: How the isovalue was chosen, for the report; None where it was given as a number.
        part: What was done to have a part of the volume, for the report; None where the whole was wanted.
    """

    settings: ConvertSettings
    on_device: DeviceVolume
    source: Volume
    choice: dict[str, Any] | None = None
    part: dict[str, Any] | None = None

    @property
    def beside(self) -> int:
        """Return the bytes of the volume as it was read, where other values are contoured."""
        return held_bytes(self.source) if self.on_device.volume is not self.source else 0


def is_settled(settings: ConvertSettings) -> bool:
    """Return whether a volume is contoured as it is read, at a number."""
    return isinstance(settings.surface.isovalue, float) and settings.part.is_whole


def finds_components(settings: ConvertSettings) -> bool:
    """Return whether the object's components are found: to choose among them, or for who chose nothing."""
    return settings.part.selects or settings.surface.isovalue is None


def prepare(
    settings: ConvertSettings, on_device: DeviceVolume, suggestions: Callable[[Volume], Suggestions]
) -> Prepared:
    """Return what is contoured of a volume on the device.

    Args:
        settings: The conversion.
        on_device: The volume as it was read.
        suggestions: Returns what a volume's values suggest.

    Raises:
        SettingsError: The isovalue is chosen by what the volume does not have, or a box lies outside.
        EmptySurfaceError: Nothing is left of the object.
        MemoryBudgetError: What that takes does not fit beside the volume.
    """
    source, part = on_device.volume, settings.part
    if is_settled(settings):
        return Prepared(settings, on_device, source)

    volume = source
    told: dict[str, Any] = {}

    def reserve(more: int) -> None:
        held = volume.values.nbytes if volume is not source else 0
        reserve_beside(source, held + more, settings, "what its preparation takes")

    if part.crop is not None:
        from dmc_cli.parts import crop_volume

        volume = crop_volume(source, part.crop, reserve)
        told["crop"] = {"shape": list(volume.shape), "origin": volume.affine[:3, 3].tolist()}
    if part.cut_table:
        volume, told["table"] = _without_table(volume, on_device, suggestions, reserve)
    asked = settings.surface.isovalue
    volume, isovalue, choice = settle_isovalue(volume, asked, suggestions(volume), reserve)
    if part.filters:
        volume = _filtered(volume, settings, on_device.device, reserve)
        told["filtered"] = {"shape": list(volume.shape), "spacing": list(volume.spacing)}
    if volume is not source:
        on_device = upload_volume(volume, on_device.device)
    settled = replace(settings, surface=replace(settings.surface, isovalue=isovalue))
    if part.selects:
        from dmc_cli.parts import select_part

        on_device, selected = select_part(on_device, settled.surface, part, reserve)
        told |= selected
    elif asked is None:
        from dmc_cli.parts import list_components

        told["components"] = list_components(on_device, settled.surface, reserve)
    return Prepared(settled, on_device, source, choice, told or None)


def _without_table(
    volume: Volume,
    on_device: DeviceVolume,
    suggestions: Callable[[Volume], Suggestions],
    reserve: Callable[[int], None],
) -> tuple[Volume, dict[str, Any]]:
    """Return the volume without what a scan's body lies on, and how much that was."""
    from dmc_cli.parts import cut_table

    level = suggestions(volume).tissue
    found = on_device if volume is on_device.volume else upload_volume(volume, on_device.device)
    found, told = cut_table(found, level, reserve)
    return found.volume, {"level": level} | told


def _filtered(
    volume: Volume, settings: ConvertSettings, device: Device, reserve: Callable[[int], None]
) -> Volume:
    """Return the volume with nodes at other distances, and smoothed."""
    from dmc_cli.parts import blending_bytes, resampled_shape, resampled_volume, smoothed_volume

    part = settings.part
    if part.resample is not None:
        reserve(blending_bytes(volume.shape, resampled_shape(volume, part.resample)))
        volume = resampled_volume(volume, part.resample, device)
    if part.smooth_volume is not None:
        reserve(blending_bytes(volume.shape, volume.shape))
        volume = smoothed_volume(volume, part.smooth_volume, device)
    return volume


def settle_isovalue(
    volume: Volume,
    asked: float | str | None,
    suggestions: Suggestions | None = None,
    reserve: Callable[[int], None] | None = None,
) -> tuple[Volume, float, dict[str, Any] | None]:
    """Return the values to contour, the isovalue as a number, and how it was chosen, None where it was given.

    Args:
        volume: The volume; of a band other values of it are contoured.
        asked: The isovalue as it was asked for.
        suggestions: What the volume's values suggest, where that is at hand.
        reserve: Is told how many bytes other values take, before they are made; it may raise.

    Raises:
        SettingsError: The isovalue is chosen by what the volume does not have.
    """
    if isinstance(asked, float):
        return volume, asked, None
    found = suggestions or Suggestions(volume)
    chosen = found.choose(asked)
    choice = _choice_section(asked, chosen, found)
    if chosen.band is None:
        return volume, chosen.isovalue, choice
    from dmc_cli.parts import band_bytes, band_volume

    if reserve is not None:
        reserve(band_bytes(volume, *chosen.band))
    return band_volume(volume, *chosen.band), 0.0, choice


def resolved_isovalue(choice: dict[str, Any] | None) -> dict[str, Any]:
    """Return what a report tells for the setting `isovalue`, if not the number: a band as it was given."""
    return {"isovalue": choice["chosen"]} if choice is not None and choice["band"] is not None else {}


def _choice_section(asked: str | None, chosen: Chosen, found: Suggestions) -> dict[str, Any]:
    """Return what the report tells of a choice; what else there is only where nothing was asked for."""
    others = {
        one.choice: one.isovalue
        for one in (found.suggested(counts=False) if asked is None else ())
        if one.choice != chosen.choice
    }
    return {
        "asked": asked,
        "chosen": chosen.choice,
        "reason": chosen.reason or None,
        "band": chosen.band,
        "others": others,
    }
