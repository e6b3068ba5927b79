"""The documents' statements hold in the code, where a test can tell."""

import re

import numpy as np
import pytest

from dmc_cli import errors, requirements
from dmc_cli.cli.signals import Stopped
from dmc_cli.files.atomic import part_of
from tests.docs.readme import README, ROOT

TEXT = README.read_text("utf-8")
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
    for path in sorted([*ROOT.glob("docs/**/*.md"), *ROOT.glob("*.md")])
}
STATUS = dict(re.findall(r"^\| ([\d, ]+) \| (.*) \|$", TEXT, re.MULTILINE))
FILES = dict(re.findall(r"^\| (volumes|meshes|report) \| (.*) \|$", TEXT, re.MULTILINE))


WORDS = re.search(r"## Words\n(.*?)\n## ", PAGES["docs/conventions.md"], re.DOTALL)[1]
GLOSSARY = re.findall(r"^\| ([^|]+?) \| (?!means|---)", WORDS, re.MULTILINE)
TERMS = [re.sub(r"( [a-z]?0–.*| 3X3Y)$", "", term) for row in GLOSSARY for term in row.split(", ")]
CODE = "\n".join(path.read_text("utf-8") for path in sorted((ROOT / "dmc_cli").rglob("*.py"))).lower()


@pytest.mark.parametrize("text", PAGES.values(), ids=PAGES)
def test_the_files_that_are_named_exist(text):
    known = {path.relative_to(ROOT).as_posix() for path in ROOT.glob("[dtb]*/**/*.py")}
    for name in set(re.findall(r"`([\w/]+\.py)", text)):
        assert any(path == name or path.endswith(f"/{name}") for path in known), name


@pytest.mark.parametrize("page", PAGES)
def test_the_links_lead_somewhere(page):
    for link in re.findall(r"\]\((?!http)([^)#]+)\)", PAGES[page]):
        assert (ROOT / page).parent.joinpath(link).exists(), link


def test_every_decision_is_listed_by_its_title():
    index = PAGES["docs/decisions/README.md"]
    listed = dict(re.findall(r"^- \[(.+)\]\((.+)\)$", index, re.MULTILINE))
    pages = {page.rpartition("/")[2]: text for page, text in PAGES.items() if "decisions/0" in page}
    assert {link: title for title, link in listed.items()} == {
        name: text.partition("\n")[0].removeprefix("# ") for name, text in pages.items()
    }


@pytest.mark.parametrize("term", TERMS)
def test_a_word_of_the_glossary_is_used(term):
    assert re.search(r"[\s_-]*".join(term.lower().split()), CODE)


def test_no_word_is_in_the_glossary_twice():
    assert len(TERMS) == len(set(TERMS))


def test_every_status_is_told_and_no_other_one():
    classes = [value for value in vars(errors).values() if isinstance(value, type)]
    raised = {str(value.exit_status) for value in classes} | {"0"}
    signals = ", ".join(str(Stopped(number).exit_status) for number in (2, 15))
    assert set(STATUS) == raised | {signals}
    assert "an output is an input" in STATUS["2"]


def test_the_pythons_that_are_told_are_those_that_are_installed_on():
    (lowest,) = re.findall(
        r'^requires-python = ">=([\d.]+)', (ROOT / "pyproject.toml").read_text(), re.MULTILINE
    )
    told = re.findall(r"Python (3\.\d+) to 3\.\d+", TEXT)
    assert len(told) == 2
    assert set(told) == {lowest}


def test_the_file_that_an_output_grows_in_is_the_one_that_is_told():
    assert f"`{part_of(ROOT / 'NAME').name}`" in PAGES["docs/conventions.md"]


def test_every_word_of_require_is_in_the_table_of_options():
    assert ", ".join(requirements.NAMES) in TEXT


@pytest.mark.parametrize(("placement", "status"), [("exact", 0), ("centroid", 6)])
def test_by_default_vertices_lie_on_the_surface_and_others_can_be_refused(run, tmp_path, placement, status):
    words = ["convert", "synth:noise:16", tmp_path / "a.ply", "-i", 0.1, "--placement", placement]
    assert run(*words, "--require", "on-surface").exit_code == status


def test_a_hole_of_no_data_is_capped_with_the_border(run, tmp_path):
    z, y, x = np.mgrid[-1:1:16j, -1:1:16j, -1:1:16j]
    values = (0.8 - np.sqrt(x * x + y * y + z * z)).astype(np.float32)
    values[:8, :8, :8] = np.nan
    np.save(tmp_path / "ball.npy", values)
    words = ["convert", tmp_path / "ball.npy", tmp_path / "a.ply", "-i", 0, "--require", "closed,manifold"]
    assert run(*words).exit_code == 6
    assert run(*words, "--border", "closed").exit_code == 0


@pytest.mark.parametrize("options", [[], ["--topology", "asymptotic"]])
def test_only_the_papers_own_meshes_may_be_other_than_manifold(run, tmp_path, options):
    words = ["convert", "synth:noise:20", tmp_path / "a.ply", "-i", 0, *options, "--require", "manifold"]
    assert run(*words).exit_code == (6 if options else 0)
