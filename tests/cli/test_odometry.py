"""``labkit odometry``: the main job, on a small log and on the head of the real one."""

import csv
import errno
import inspect
import io
import re

import numpy as np
import pytest

from labkit.cli import outputs
from labkit.logs import read_log, read_tum, write_tum
from labkit.odometry import causes, remarks
from labkit.se2 import from_xytheta, matrices_of
from labkit.support.errors import WriteError

NOTHING = ("--out", "none")
FILES = [
    *("room-map.pgm", "room-map.png", "room-map.yaml"),
    *("room-odometry.tum", "room-quality.csv"),
]


@pytest.fixture
def files(tmp_path):
    return lambda: sorted(path.name for path in tmp_path.iterdir())


def test_a_log_becomes_a_trajectory_a_table_and_a_map(run, carmen_log, files, tmp_path):
    log, path = carmen_log
    status, out, err = run("odometry", log)
    assert status == 0
    assert "room: 8 scans, prior: the log's odometry" in out
    assert "7 matched (0 after a search, 0 against the prior), 0 from the prior, 0 sk" in out
    assert files() == FILES
    stamps, poses = read_tum(tmp_path / "room-odometry.tum")
    assert stamps.tolist() == [k + 0.5 for k in range(8)]
    driven = path - path[0]
    c, s = np.cos(path[0, 2]), np.sin(path[0, 2])
    assert np.abs(poses[:, :2] - driven[:, :2] @ [[c, -s], [s, c]]).max() < 0.01
    assert "Traceback" not in err
    rows = list(csv.DictReader((tmp_path / "room-quality.csv").read_text().splitlines()))
    assert {row["decision"] for row in rows[1:]} <= {"icp", "confirmed"}
    assert rows[0]["rmse_m"] == ""
    assert 0.0 < float(rows[3]["rmse_m"]) < 0.1
    assert 0.4 < float(rows[3]["inlier_ratio"]) <= 1.0
    endings = [row["termination"].partition("_")[0] for row in rows]
    assert endings == ["converged" if row["decision"] == "icp" else "" for row in rows]
    assert 0.8 < float(rows[3]["score"]) <= float(rows[3]["agreement"]) <= 1.0
    assert 0.0 < float(rows[3]["cov_xx"]) < 1e-3
    assert (rows[3]["against_prior"], rows[3]["doubtful"]) == ("0", "0")
    assert (rows[0]["ambiguous"], rows[3]["ambiguous"], rows[3]["margin"]) == ("", "0", "")


def test_the_robot_s_path_stands_beside_the_scanner_s_and_each_is_named(run, carmen_log, tmp_path):
    """The law: T_w_robot @ T_robot_laser = T_w_laser, but for the axes of the first pose."""
    offset = (-0.2, 0.1, np.pi)
    run("odometry", carmen_log[0], "--laser-offset", *offset)

    scanner, robot = (read_tum(f"room-{name}.tum")[1] for name in ("odometry", "robot"))
    mounted = matrices_of(robot) @ from_xytheta(offset)
    expected = np.linalg.inv(mounted[0]) @ mounted
    np.testing.assert_allclose(matrices_of(scanner), expected, atol=1e-9)
    heads = [(tmp_path / f"room-{name}.tum").read_text()[:30] for name in ("odometry", "robot")]
    assert [head.split(",")[0] for head in heads] == [
        "# poses of the scanner",
        "# poses of the robot",
    ]
    rows = list(csv.DictReader((tmp_path / "room-quality.csv").read_text().splitlines()))
    table = [[float(row[f"robot_{axis}"]) for axis in ("x_m", "y_m")] for row in rows]
    np.testing.assert_allclose(table, robot[:, :2], atol=1e-6)
    assert "poses of the robot stand in them" in (tmp_path / "room-map.yaml").read_text()


def test_a_folder_takes_files_of_the_log_s_name_and_quiet_is_quiet(
    run, carmen_log, files, tmp_path
):
    (tmp_path / "runs").mkdir()
    for folder in ("runs", "runs/"):
        assert run("odometry", carmen_log[0], "-q", "--out", folder) == (0, "", "")
    found = sorted(path.name for path in (tmp_path / "runs").iterdir())
    assert found == FILES


def test_a_log_comes_through_standard_input(run, carmen_log, monkeypatch, files):
    with carmen_log[0].open("rb") as log:
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(log))
        status, out, _ = run("odometry", "-")
    assert (status, "stdin: 8 scans, prior: the log's odometry" in out) == (0, True)
    assert files() == [name.replace("room", "stdin") for name in FILES]


@pytest.mark.parametrize(
    ("text", "options", "told"),
    [
        (b"", (), "standard input: the file is empty"),
        (b"scan,x,y\n0,1,2\n1,1,2\nmud\n", NOTHING, "skipped standard input:4: "),
        (
            b"x,y\n1,2\n",
            ("--topic", "/scan"),
            "cannot be used for standard input, a log of the format",
        ),
    ],
)
def test_messages_name_standard_input_and_no_copy_of_it(run, monkeypatch, text, options, told):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text)))
    _, _, err = run("odometry", "-", *options)
    assert told in err


def test_an_empty_prefix_is_a_mistake_of_the_command_line(run, carmen_log, files):
    status, _, err = run("odometry", carmen_log[0], "--out", "")
    assert (status, files()) == (2, [])
    assert "--out must name files, or be `none`" in err


def test_a_part_of_a_log_is_that_part(run, carmen_log, tmp_path):
    assert "3 scans" in run("odometry", carmen_log[0], "--start", 4, "--scans", 3)[1]
    assert read_tum(tmp_path / "room-odometry.tum")[0].tolist() == [4.5, 5.5, 6.5]
    status, _, err = run("odometry", carmen_log[0], "--start", 8)
    assert (status, "of no more than 8 scans; choose a smaller `start` (`--start`)" in err) == (
        1,
        True,
    )


@pytest.mark.parametrize("option", ["--start", "--scans"])
def test_a_number_beyond_all_counts_is_a_mistake_of_the_command_line(run, carmen_log, option):
    status, _, err = run("odometry", carmen_log[0], option, 2**70)
    assert status == 2
    assert f"{option} must be a whole number of at least" in err


def test_a_full_disk_stops_a_run_before_the_matching(run, carmen_log, monkeypatch, files):
    def full(**options):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("labkit.cli.outputs.TemporaryFile", full)
    status, out, err = run("odometry", carmen_log[0])
    assert (status, out, files()) == (1, "", [])
    assert "cannot write room-odometry.tum: No space left on device; choose another --out" in err


@pytest.mark.parametrize("failing", [0, 2, 3, 4, 5])
def test_a_file_that_fails_costs_neither_the_summary_nor_the_others(
    run, carmen_log, monkeypatch, files, failing
):
    def fail(path, *given):
        raise WriteError(f"cannot write {path}: no more room")

    ending = list(outputs.WRITERS)[failing]
    monkeypatch.setitem(outputs.WRITERS, ending, fail)
    status, out, err = run("odometry", carmen_log[0])
    assert (status, "7 matched" in out, len(files())) == (1, True, len(FILES) - 1)
    assert f"labkit odometry: cannot write room{ending}: no more room" in err


def test_progress_is_told_where_there_is_no_terminal(run, carmen_log, monkeypatch):
    monkeypatch.setattr("labkit.support.progress.SECONDS_BETWEEN_LINES", 0.0)
    _, _, err = run("odometry", carmen_log[0], *NOTHING)
    assert "reading: 3 lines\n" in err
    assert "matching: 5 of 8 scans\n" in err


def test_what_is_odd_about_a_log_is_told_and_overridden(run, carmen_log):
    odd = carmen_log[0].parent / "odd.log"
    ranges = carmen_log[0].read_text().split("\n")[0].split()[2:183]
    rows = [*("8.191" if k % 9 == 0 else r for k, r in enumerate(ranges))]
    line = f"FLASER 181 {' '.join(rows)} 0 0 0 0 0 0 %s host 1.0\n"
    odd.write_text("".join(line % stamp for stamp in (1.0, 2.0, 2.0)) + 7 * "FLASER x\n")
    _, _, err = run("odometry", odd, *NOTHING)
    assert "note: 63 of 543 ranges (12 %) read 8.191 m: codes for no return" in err
    assert f"skipped {odd}:4: the number of beams is 'x', expected" in err
    assert "... and 2 more damaged lines" in err
    assert "note: the clock of the scans stands still or runs backwards 1 times, first at" in err
    for values in ([], ["7.77"]):
        assert "8.191" not in run("odometry", odd, "--no-return", *values, *NOTHING)[2]


def test_a_table_of_ranges_has_no_prior_and_none_writes_nothing(run, carmen_log, files, tmp_path):
    rows = [scan.ranges for scan in read_log(carmen_log[0]).scans]
    np.savetxt(tmp_path / "scans.csv", rows, delimiter=",", fmt="%.4f")
    status, out, _ = run("odometry", "scans.csv", "--angles", -np.pi / 2, np.pi / 2, *NOTHING)
    assert (status, "prior: the last motion" in out) == (0, True)
    assert "7 matched (0 after a search" in out
    assert (files(), "wrote" in out) == (["scans.csv"], False)


def test_wheels_from_a_file_are_those_of_the_log(run, carmen_log, tmp_path):
    log = read_log(carmen_log[0])
    write_tum(tmp_path / "wheels.tum", log.stamps, log.odometry)
    rows = [[scan.stamp, *scan.ranges] for scan in log.scans]
    header = ",".join(["stamp", *(f"r{k}" for k in range(len(rows[0]) - 1))])
    np.savetxt(tmp_path / "scans.csv", rows, delimiter=",", header=header, comments="")
    angles = ("--angles", log.scans[0].angles[0], log.scans[0].angles[-1])
    status, out, err = run("odometry", "scans.csv", *angles, "--odometry", "wheels.tum")
    assert (status, "prior: the odometry of wheels.tum" in out) == (0, True), err
    run("odometry", carmen_log[0])
    ours, theirs = (read_tum(f"{name}-odometry.tum")[1] for name in ("scans", "room"))
    np.testing.assert_allclose(ours, theirs, atol=1e-3)


def test_wheels_that_are_silent_or_in_another_unit_are_told(run, carmen_log):
    log = read_log(carmen_log[0])
    write_tum("wheels.tum", log.stamps[:5], 1e2 * log.odometry[:5])
    status, _, err = run("odometry", carmen_log[0], "--odometry", "wheels.tum", *NOTHING)
    assert (status, err.count("note: ")) == (0, 3), err
    assert "note: 3 of 8 scans have no odometry, the first at 5.5 s: it is silent" in err
    assert "are the odometry and the ranges in metres?" in err
    assert "in 4 steps the wheels told more than the robot can do" in err
    assert "raise `max_translation` (`--max-translation`)" in err


def test_a_run_that_did_not_match_says_so(run, carmen_log, tmp_path):
    rows = [1e3 * scan.ranges for scan in read_log(carmen_log[0]).scans]
    np.savetxt(tmp_path / "scans.csv", rows, delimiter=",", fmt="%.1f")
    status, _, err = run("odometry", "scans.csv", "--angles", -1.5, 1.5, *NOTHING)
    assert (status, err.count("no match that is believed")) == (0, 1)


def test_the_head_of_killian_against_its_reference(run, files):
    """The built-in run: simulated wheels, errors of the odometry and of the prior."""
    status, out, _ = run("odometry", "killian", "--scans", "60", "--out", "head")
    assert status == 0
    assert "killian: 60 scans" in out
    assert "prior: wheel odometry simulated from the reference, seed 0" in out
    assert "odometry, RPE a step" in out
    assert "prior, RPE a step" in out
    assert files() == [name.replace("room", "head") for name in FILES]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("gone.log",), "gone.log"),
        (("{log}", "--out", "no/such/t"), "cannot write no/such/t-odometry.tum"),
        (("{log}", "--odometry", "room-odometry.tum"), "room-odometry.tum: it is read from"),
        (
            ("{pair}", "--odometry", "{log}"),
            "pair.log: holds no times, which `odometry` (`--odometry`) needs",
        ),
        (
            ("{log}", "--odometry", "wheels.tum", "--prior", "none"),
            "--prior leaves `--odometry` aside: drop one",
        ),
        (("{log}", "--odometry", "wheels.tum"), "wheels.tum: `stamps` must lie within `times`"),
        (("{points}", "--scans", "2"), "a single scan; a motion needs two"),
        (("{cut}", "--strict"), "cut.log:8: "),
    ],
)
def test_what_cannot_be_done_is_said_and_leaves_no_file(
    run, carmen_log, tmp_path, arguments, message
):
    log, _ = carmen_log
    names = ("points", "pair", "cut")
    inputs = {"log": log} | {name: tmp_path / f"{name}.log" for name in names}
    write_tum(tmp_path / "wheels.tum", [0.0, 1.0], np.zeros((2, 3)))
    write_tum(tmp_path / "room-odometry.tum", np.arange(10.0), np.zeros((10, 3)))
    inputs["points"].write_text("1.0,2.0\n1.5,2.0\n2.0,2.5\n")
    inputs["pair"].write_text("scan,x,y\n0,1.0,2.0\n1,1.0,2.1\n")
    inputs["cut"].write_text(log.read_text()[:-400])
    before = sorted(tmp_path.iterdir())
    status, _, err = run("odometry", *(text.format(**inputs) for text in arguments))
    assert status == (2 if "--prior" in arguments else 1)  # an option, or a file
    assert message in err
    assert "Traceback" not in err
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("module", [causes, remarks])
def test_each_option_that_a_remark_on_a_run_names_is_one_of_the_command(run, module):
    named = re.findall(r"`(--[a-z-]+)", inspect.getsource(module))

    _, out, _ = run("odometry", "--help")

    assert named
    assert [option for option in named if f"{option} " not in out] == []
