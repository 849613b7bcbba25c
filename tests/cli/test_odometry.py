"""``labkit odometry``: the main job, on a small log and on the head of the real one."""

import csv
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from labkit.cli import log_options
from labkit.logs import read_tum


@pytest.fixture
def files(tmp_path):
    return lambda: sorted(path.name for path in tmp_path.iterdir())


def test_a_log_becomes_a_trajectory_a_table_and_a_map(run, carmen_log, files, tmp_path):
    log, path = carmen_log
    status, out, err = run("odometry", log)
    assert status == 0
    assert "room: 8 scans, point_to_line metric, prior: the log's odometry" in out
    assert "7 steps" in out
    assert "7 from ICP (0 on the second attempt, 0 after a search)" in out
    assert "0 from the prior, 0 skipped" in out
    assert files() == ["room-map.png", "room-odometry.tum", "room-quality.csv"]
    stamps, poses = read_tum(tmp_path / "room-odometry.tum")
    assert stamps.tolist() == [k + 0.5 for k in range(8)]
    driven = path - path[0]
    c, s = np.cos(path[0, 2]), np.sin(path[0, 2])
    assert np.abs(poses[:, :2] - driven[:, :2] @ [[c, -s], [s, c]]).max() < 0.01
    assert "Traceback" not in err


@pytest.mark.parametrize("prior", ["log", "none"])
def test_a_long_log_is_streamed_and_gives_the_same_files(
    run, carmen_log, tmp_path, monkeypatch, prior
):
    outcomes = []
    for length in (log_options.LONG, 1):
        monkeypatch.setattr(log_options, "LONG", length)
        status, out, _ = run("odometry", carmen_log[0], "--scans", 6, "--prior", prior)
        assert (status, "room: 6 scans" in out) == (0, True)
        names = ("room-odometry.tum", "room-quality.csv", "room-map.png")
        outcomes.append([(tmp_path / name).read_bytes() for name in names])
    assert outcomes[0] == outcomes[1]


def test_what_is_odd_about_a_log_is_told_and_overridden(run, carmen_log):
    nothing = ("--out", "none", "--quality", "none", "--plot", "none")
    odd = carmen_log[0].parent / "odd.log"
    ranges = carmen_log[0].read_text().split("\n")[0].split()[2:183]
    rows = [*("8.191" if k % 9 == 0 else r for k, r in enumerate(ranges))]
    line = f"FLASER 181 {' '.join(rows)} 0 0 0 0 0 0 %s host 1.0\n"
    odd.write_text("".join(line % stamp for stamp in (1.0, 2.0, 2.0)))
    _, _, err = run("odometry", odd, *nothing)
    assert "note: 63 of 543 ranges (12 %) read 8.191 m: codes for no return" in err
    assert "note: the clock of the scans stands still 1 times, first at line 3" in err
    for value in ("off", "7.77"):
        assert "8.191" not in run("odometry", odd, "--no-return", value, *nothing)[2]


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        (("--max-bytes", "1000"), "room.log: more than 1,000 bytes; if it is what you expect, "),
        (("--max-line-bytes", "1000"), "room.log: no line of up to 1,000 bytes; if it is what"),
    ],
)
def test_a_file_beyond_its_limits_is_refused(run, carmen_log, files, limit, message):
    status, _, err = run("odometry", carmen_log[0], *limit)
    assert (status, files()) == (1, [])
    assert message in err
    assert run("odometry", carmen_log[0], limit[0], "0")[0] == 2


def test_the_quality_file_has_a_row_a_scan(run, carmen_log, tmp_path):
    run("odometry", carmen_log[0], "--plot", "none", "--out", "none", "--quality", "q.csv")
    rows = list(csv.DictReader((tmp_path / "q.csv").read_text().splitlines()))
    assert [row["decision"] for row in rows] == ["start"] + 7 * ["icp"]
    assert rows[0]["rmse_m"] == ""
    assert 0.0 < float(rows[3]["rmse_m"]) < 0.1
    assert 0.4 < float(rows[3]["inlier_ratio"]) <= 1.0
    assert rows[3]["termination"].startswith("converged")
    assert 0.0 < float(rows[3]["cost_m2"]) < float(rows[3]["rmse_m"]) ** 2
    assert 0.0 <= float(rows[3]["seen_through"]) < 0.1
    assert (rows[0]["ambiguous"], rows[3]["ambiguous"], rows[3]["margin"]) == ("", "0", "")


def test_none_writes_nothing(run, carmen_log, files):
    nothing = ("--out", "none", "--quality", "none", "--plot", "none")
    status, out, _ = run("odometry", carmen_log[0], *nothing)
    assert (status, files()) == (0, [])
    assert "wrote" not in out


def test_a_trajectory_as_a_graph(run, carmen_log, tmp_path):
    run("odometry", carmen_log[0], "--out", "graph.g2o", "--quality", "none", "--plot", "none")
    words = [line.split()[0] for line in (tmp_path / "graph.g2o").read_text().splitlines()]
    assert words.count("VERTEX_SE2"), words.count("EDGE_SE2") == (8, 7)


@pytest.mark.parametrize("turn", [0.0, 0.05])
def test_a_robot_that_stays_in_its_place(run, carmen_log, files, tmp_path, turn):
    """No rigid alignment is the best one there; the first poses are aligned instead."""
    ranges = carmen_log[0].read_text().split()[2:183]
    head = f"ROBOTLASER1 0 {-np.pi / 2} {np.pi} {np.pi / 180} 80 0.1 0 181 {' '.join(ranges)} 0"
    lines = []
    for k in range(5):
        pose = f"0 0 {turn * k}"
        lines += [f"VERTEX_SE2 {k} {pose}", f"{head} {pose} {pose} 0 0 0 0 0 {k} robot {k}"]
    (tmp_path / "still.g2o").write_text("\n".join(lines) + "\n")
    status, out, _ = run("odometry", "still.g2o", "--plot", "none")
    assert status == 0
    assert files() == ["still-odometry.tum", "still-quality.csv", "still.g2o"]
    assert "wrote still-odometry.tum, still-quality.csv\n" in out
    assert "odometry, ATE, first poses aligned" in out
    assert "prior, ATE, first poses aligned" in out


def test_the_head_of_killian_against_its_reference(run, files):
    """The built-in run: simulated wheels, errors of the odometry and of the prior."""
    status, out, _ = run("odometry", "killian", "--scans", "60", "--plot", "none")
    assert status == 0
    assert "killian: 60 scans" in out
    assert "prior: wheel odometry simulated from the reference, seed 0" in out
    assert "odometry, RPE a step" in out
    assert "prior, RPE a step" in out
    assert files() == ["killian-odometry.tum", "killian-quality.csv"]


def test_the_same_seed_gives_the_same_bytes(run, tmp_path):
    for name in ("a.tum", "b.tum"):
        nothing_else = ("--quality", "none", "--plot", "none")
        run("odometry", "killian", "--scans", 20, "--out", name, *nothing_else)
    assert (tmp_path / "a.tum").read_bytes() == (tmp_path / "b.tum").read_bytes()


SLOWLY = (  # 0.01 s a scan, so that no machine is done before it is stopped
    "import time\n"
    "from labkit.cli import odometry\n"
    "progress = odometry.tqdm\n"
    "def slowly(scans, **options):\n"
    "    for scan in progress(scans, **options):\n"
    "        time.sleep(0.01)\n"
    "        yield scan\n"
    "odometry.tqdm = slowly\n"
)


def start(folder, *arguments, threads="1", before=""):
    """The command line in a process group of its own."""
    program = "import signal, sys\n"
    program += "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    program += before + "from labkit.cli import main\nsys.exit(main())"
    return subprocess.Popen(
        [sys.executable, "-u", "-c", program, "odometry", "killian", *map(str, arguments)],
        cwd=folder,
        env=os.environ | {"OMP_NUM_THREADS": threads},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def living(group):
    """The processes of a group that still run."""
    listed = subprocess.run(["ps", "-eo", "pgid,stat"], capture_output=True, text=True, check=True)
    rows = [line.split() for line in listed.stdout.splitlines()[1:]]
    return [row for row in rows if int(row[0]) == group and not row[1].startswith("Z")]


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs the process groups of POSIX")
@pytest.mark.parametrize("against", ["map", "scan"])
@pytest.mark.parametrize(("ends", "status"), [("SIGINT", 130), ("SIGTERM", -15)])
def test_a_run_that_is_stopped_leaves_no_process_and_no_file(
    killian, tmp_path, against, ends, status
):
    """Ctrl-C, which every process of the terminal gets, and a kill that one of them gets."""
    with start(tmp_path, "--against", against, before=SLOWLY) as process:
        assert "killian: 3873 scans" in process.stdout.readline()
        if ends == "SIGINT":
            os.killpg(process.pid, signal.SIGINT)
        else:
            process.terminate()
        _, err = process.communicate(timeout=60)
    deadline = time.monotonic() + 20.0
    while living(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert living(process.pid) == []
    assert process.returncode == status
    if ends == "SIGINT":
        assert err.strip() == "labkit odometry: interrupted; no file is left half-written"
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_kind_of_figure_is_refused_before_the_work(run, carmen_log, files):
    status, out, err = run("odometry", carmen_log[0], "--plot", "map.bmp")
    assert (status, out, files()) == (2, "", [])
    assert "a figure's name must end in .png, .pdf or .svg, got 'map.bmp'" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("gone.log",), "gone.log"),
        (("{log}", "--out", "no/such/t.tum"), "cannot write no/such/t.tum"),
        (("{log}", "--plot", "."), "cannot write .: it is a directory"),
        (("{log}", "--out", "a", "--quality", "./a"), "cannot write ./a: it is written by this"),
        (("{pair}", "--out", "pair.log"), "cannot write pair.log: it is the log itself"),
        (("{log}", "--prior", "simulated"), "no reference to simulate wheels from"),
        (("{pair}", "--prior", "log"), "holds no odometry for `--prior log`"),
        (("{points}", "--scans", "2"), "a single scan; a motion needs two"),
        (("{binary}",), "unknown format"),
        (("{cut}", "--strict"), "cut.log:8: "),
    ],
)
def test_what_cannot_be_done_is_said_and_leaves_no_file(
    run, carmen_log, tmp_path, arguments, message
):
    log, _ = carmen_log
    names = ("points", "pair", "binary", "cut")
    inputs = {"log": log} | {name: tmp_path / f"{name}.log" for name in names}
    inputs["points"].write_text("1.0,2.0\n1.5,2.0\n2.0,2.5\n")
    inputs["pair"].write_text("scan,x,y\n0,1.0,2.0\n1,1.0,2.1\n")
    inputs["binary"].write_bytes(bytes(range(256)) * 8)
    inputs["cut"].write_text(log.read_text()[:-400])
    before = sorted(tmp_path.iterdir())
    status, _, err = run("odometry", *(text.format(**inputs) for text in arguments))
    assert status == 1
    assert message in err
    assert "Traceback" not in err
    assert sorted(tmp_path.iterdir()) == before


def test_a_damaged_line_is_reported_and_skipped(run, carmen_log, tmp_path):
    log, _ = carmen_log
    cut = tmp_path / "cut.log"
    cut.write_text(log.read_text()[:-400])
    status, out, err = run("odometry", cut, "--plot", "none")
    assert status == 0
    assert "7 scans" in out
    assert "skipped " in err
    assert "cut.log:8: " in err
