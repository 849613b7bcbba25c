import importlib.util
import shutil
import sys

import numpy as np
import pytest

from labkit.errors import LogError
from labkit.extras import MissingExtraError
from labkit.logs import read_killian, read_log
from labkit.logs.killian import killian_archive
from labkit.se2 import from_xytheta, relative, to_xytheta

installed = pytest.mark.skipif(
    importlib.util.find_spec("rtbdata") is None, reason="rtb-data is not installed"
)


@pytest.fixture(scope="module")
def killian():
    return read_killian()


@installed
def test_every_scan_and_its_vertex(killian):
    assert (len(killian), killian.name, killian.format) == (3873, "killian", "g2o")
    assert killian.skipped == ()
    assert killian.odometry is None
    assert killian.reference.shape == (3873, 3)
    assert (np.diff(killian.stamps) > 0.0).all()


@installed
def test_beams_are_one_degree_apart_and_shorter_than_50_m(killian):
    for scan in killian.scans:
        assert scan.ranges.shape == (180,)
        assert (scan.ranges[scan.beams] < 50.0).all()
        assert len(scan) == np.count_nonzero(scan.ranges < 50.0)
    degrees = np.degrees(killian.scans[0].angles)
    np.testing.assert_allclose(degrees, -90.0 + np.arange(180), atol=1e-4)
    assert max(scan.ranges.max() for scan in killian.scans) == 51.16


@installed
def test_steps_are_those_of_the_run(killian):
    T = from_xytheta(killian.reference)
    steps = to_xytheta(relative(T[:-1], T[1:]))
    length, turn = np.hypot(steps[:, 0], steps[:, 1]), np.degrees(np.abs(steps[:, 2]))
    assert np.median(length) == pytest.approx(0.52, abs=0.005)
    assert length.max() == pytest.approx(0.84, abs=0.005)
    assert length.sum() == pytest.approx(1906.0, abs=1.0)
    assert np.median(turn) == pytest.approx(0.7, abs=0.05)
    assert np.percentile(turn, 95) == pytest.approx(13.0, abs=0.5)


@installed
def test_the_name_wins_over_a_file_of_that_name(save, run, monkeypatch):
    path = save(run, "killian")
    monkeypatch.chdir(path.parent)
    assert len(read_log("killian")) == 3873
    assert len(read_log("./killian")) == len(read_log(path)) == 5


@installed
def test_options_reach_the_built_in_run(killian):
    log = read_log("killian", range_max=5.0, laser_offset=(0.1, 0.0, 0.0), strict=True)
    assert all((scan.ranges[scan.beams] < 5.0).all() for scan in log.scans)
    moved = np.hypot(*(log.reference - killian.reference)[:, :2].T)
    np.testing.assert_allclose(moved, 0.1)


def test_a_missing_package_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "rtbdata", None)
    with pytest.raises(MissingExtraError, match=r'rtb-data, .* install "labkit\[killian\]"$'):
        read_log("killian")


@installed
def test_a_package_without_the_file(monkeypatch, tmp_path):
    (tmp_path / "rtbdata").mkdir()
    (tmp_path / "rtbdata" / "__init__.py").touch()
    monkeypatch.delitem(sys.modules, "rtbdata", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(LogError, match=r"data/killian\.g2o\.zip of rtb-data, which came without"):
        killian_archive()
    monkeypatch.undo()


@installed
def test_a_broken_download_keeps_its_first_scans(tmp_path, killian):
    path = shutil.copy(killian_archive(), tmp_path / "killian.g2o.zip")
    packed = path.read_bytes()
    path.write_bytes(packed[: len(packed) // 10])
    log = read_log(path)
    assert 100 < len(log) < 3873
    assert (log.reference == killian.reference[: len(log)]).all()
    assert "the zip archive ends early" in str(log.skipped)
