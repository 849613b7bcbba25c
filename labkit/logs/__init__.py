"""Logs in, trajectories in and out: the files that a run comes from and ends up in.

`read_log` reads every log format, told from the content; `read_points` a single scan.
`write_tum` and `write_g2o` write what was estimated, whole or not at all.
"""

from labkit.logs.g2o import write_g2o
from labkit.logs.log import Log, SkippedLine
from labkit.logs.points import read_points, write_points
from labkit.logs.read_log import read_killian, read_log
from labkit.logs.tum import read_tum, write_tum

__all__ = [
    "Log",
    "SkippedLine",
    "read_killian",
    "read_log",
    "read_points",
    "read_tum",
    "write_g2o",
    "write_points",
    "write_tum",
]
