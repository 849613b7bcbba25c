"""``labkit info``: what a log holds, before any matching."""

import numpy as np
import pytest


def test_a_log_s_scanner_wheels_and_lines_are_told(run, carmen_log):
    status, out, err = run("info", "-q", carmen_log[0])
    assert (status, err) == (0, "")
    assert "room: 8 scans, format carmen; 0.5 to 7.5 s, 7 s in all, one each 1 s" in out
    assert "181 from -90° to 90°, each 1°" in out
    assert "wheels     0.7139 m and 12.03° of turns in all" in out
    assert "FLASER                       8 lines" in out


def test_what_is_left_out_is_told(run, tmp_path):
    rows = [f"{k},{a:.2f},2,{k}" for k in range(4) for a in np.linspace(-1.0, 1.0, 30)]
    (tmp_path / "run.csv").write_text("scan,angle,range,speed\n" + "\n".join(rows))

    _, out, err = run("info", "-q", "run.csv")

    line = next(line for line in out.splitlines() if "speed" in line)
    assert line.endswith("not read")
    assert "note: not read: 'speed' (column)" in err


@pytest.mark.parametrize(("option", "value"), [("--range-unit", "km"), ("--start", "-1")])
def test_a_wrong_option_is_a_mistake_of_the_command_line(run, carmen_log, option, value):
    status, _, err = run("info", carmen_log[0], option, value)
    assert status == 2
    assert f"labkit info: {option} must be" in err
