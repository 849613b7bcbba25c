"""``labkit match``: two CSV scans in, one transform out."""

import numpy as np
import pytest


def test_the_transform_between_two_files(run, scan_files):
    target, source = scan_files
    status, out, err = run("match", target, source)
    assert (status, err) == (0, "")
    assert "t = (0.1000, -0.0500) m, theta = 1.719 deg" in out
    assert "102 inliers (fitness 0.850)" in out
    status, out, _ = run("match", target, source, "--initial", 50, 0, 0)
    assert (status, out.startswith("failed: fewer than")) == (1, True)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "empty"),
        ("1.0,2.0\nnan,3.0\n", "source.csv:2: "),
        ("scan,x,y\n0,1.0,2.0\n1,1.0,2.0\n", "rows `x,y` in metres, got Log(source: 2 scans, po"),
        (
            "PARAM a 1\nFLASER 2 1 1 0 0 0 0 0 0 1 host 2\n",
            "source.csv: expected one scan of points, rows `x,y`",
        ),
    ],
)
def test_a_bad_file_is_named_with_its_line(run, scan_files, tmp_path, content, message):
    (tmp_path / "source.csv").write_text(content)
    status, out, err = run("match", "target.csv", "source.csv")
    assert (status, out) == (1, "")
    assert message in err
    assert err.startswith("labkit match: ")


def test_what_is_odd_about_a_file_is_told(run, scan_files, tmp_path):
    """Millimetres look like a very large room."""
    for name in scan_files:
        points = np.loadtxt(tmp_path / name, delimiter=",")
        np.savetxt(tmp_path / name, 1e3 * points, delimiter=",")
    _, _, err = run("match", *scan_files)
    notes = [line.partition(": half of the points")[0] for line in err.splitlines()]
    assert notes == ["note: target.csv", "note: source.csv"]
