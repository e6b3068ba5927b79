"""Wrong words on the command line end with status 2 and say what was expected."""

import pytest

CONVERT = ["convert", "synth:sphere:8", "out.ply", "-i", "0"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["convert", "synth:sphere:8"], "Missing argument 'OUTPUT'"),
        ([*CONVERT, "--shape", "4,4"], "'4,4' has 2 part(s); expected three integers"),
        ([*CONVERT, "--shape", "4,4,x"], "expected three integers with commas between"),
        ([*CONVERT, "--spacing", "1,1,-1"], "spacing is (1.0, 1.0, -1.0); expected three positive lengths"),
        ([*CONVERT, "--memory", "lots"], "'lots' is no size; expected a number of bytes, as in 4G"),
        ([*CONVERT, "--require", "closed,pretty"], "require is 'pretty'; expected one of manifold, closed"),
        (
            [*CONVERT, "--require", "shape_mn>=1"],
            "no figure of the report is called; expected one such as shape_m",
        ),
        (["measure", "a.ply", "--require", "max<=1"], "expected one of deviation.max, curvature.mean.max"),
        ([*CONVERT, "--topology", "weird"], "'weird' is not one of 'manifold', 'asymptotic'"),
        ([*CONVERT, "--method", "zz"], "method is 'zz'; expected one of dmc"),
        ([*CONVERT, "--device", "tpu"], "device is 'tpu'; expected auto, cpu, cuda or cuda:N"),
        ([*CONVERT, "--threads", "0"], "threads is 0; expected 1 or more"),
        ([*CONVERT, "--threads", "9" * 30], "threads is beyond 4096; expected as many as there are"),
        (["info", "synth:sphere:8", "--threads", "0"], "threads is 0; expected 1 or more"),
        ([*CONVERT, "--seed", "-1"], "seed is -1; expected a whole number, 0 or more"),
        (["synth", "noise", "a.nrrd", "--seed", "-1"], "seed is -1; expected a whole number, 0 or more"),
        ([*CONVERT, "--sigma", "1e300"], "sigma is 1e+300; expected a number of nodes, 0 to 10000"),
        (["info", "synth:noise:8", "--sigma", "nan"], "sigma is nan; expected a number of nodes"),
        ([*CONVERT, "--simplify", "most"], "'most' is not one of 'none', '3x3y', '3333', 'all'"),
        ([*CONVERT, "--frobnicate"], "No such option"),
        ([*CONVERT, "--halfedges", "mesh.zip"], "expected .npz or .txt for halfedges"),
        (["convert", "synth:sphere:8", "out.ply", "-i", "nan"], "isovalue is nan; expected a finite number"),
        (["convert", "synth:cone:8", "out.ply", "-i", "0"], "expected synth:FIELD:N"),
        (["synth", "cone", "cone.nrrd"], "'cone' is not one of 'genus_two', 'iwp'"),
        (["synth", "iwp", "iwp.xyz"], "iwp.xyz has no suffix that is known; expected one of .nii"),
        (["synth", "iwp", "iwp.nrrd", "-n", "1"], "nodes is 1; expected at least 2"),
        (["frobnicate"], "No such command"),
    ],
)
def test_usage_errors(run, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    result = run(*words)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_an_isovalue_that_is_nothing_known_is_answered_with_what_there_is(run, tmp_path):
    result = run("convert", "synth:sphere:9", tmp_path / "out.ply", "-i", "half")
    assert result.exit_code == 2
    assert "'half' is no isovalue; expected a number, otsu, otsu:N" in " ".join(result.stderr.split())


@pytest.mark.parametrize(
    ("word", "size"), [("4G", 4 << 30), ("500M", 500 << 20), ("1.5GiB", 3 << 29), ("123", 123)]
)
def test_sizes_have_units(word, size):
    from dmc_cli.cli.parameters import Size

    assert Size()(word) == size
