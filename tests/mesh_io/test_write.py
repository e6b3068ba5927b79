"""An output has the format that its suffix or option names, and no other suffix is taken."""

import re

import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.mesh_formats import known_suffixes
from dmc_cli.mesh_io.halfedge_dump import check_dump_name
from dmc_cli.mesh_io.write import choose_format, write_mesh

KNOWN = ", ".join(known_suffixes())


@pytest.mark.parametrize(
    ("path", "asked", "chosen"),
    [
        ("a.ply", None, "ply"),
        ("a.b/c.OBJ", None, "obj"),
        ("a.ply.off", None, "off"),
        ("a.ply", "off", "off"),
        ("a", "obj", "obj"),
        ("-", "ply", "ply"),
    ],
)
def test_the_format_is_the_one_asked_for_or_the_suffix(path, asked, chosen):
    assert choose_format(path, asked) == chosen


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("-", "^standard output has no suffix; name the format with --output-format$"),
        ("a", rf"^a has no suffix; expected one of {re.escape(KNOWN)}; rename the output, or name"),
        ("a.STP", rf"^a\.STP has the suffix \.stp; expected one of {re.escape(KNOWN)}; rename"),
    ],
)
def test_an_unknown_suffix_is_told(path, told):
    with pytest.raises(SettingsError, match=told):
        choose_format(path)


@pytest.mark.parametrize("path", ["a.npz", "a.TXT", "-"])
def test_names_of_halfedge_dumps(path):
    check_dump_name(path)


@pytest.mark.parametrize(("path", "found"), [("a.zip", "the suffix .zip"), ("npz", "no suffix")])
def test_other_names_of_halfedge_dumps_are_told(path, found):
    with pytest.raises(SettingsError, match=f"^{path} has {found}; expected .npz or .txt for halfedges"):
        check_dump_name(path)


def test_what_was_written_is_told(tmp_path, cube):
    path = str(tmp_path / "a.dat")
    written = write_mesh(path, cube, output_format="obj")
    assert (written.path, written.format, written.warnings) == (path, "obj", ())
    assert written.size == (tmp_path / "a.dat").stat().st_size
