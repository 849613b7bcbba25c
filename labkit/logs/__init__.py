"""Logs and trajectories: reading and writing.

`read_log` reads every format and recognises it by its content. `write_tum` and `write_g2o`
write an estimate, whole or not at all.
`interpolate_poses` brings odometry to the times of the scans.
"""

from labkit.logs.interpolation import interpolate_poses
from labkit.logs.log import Log, SkippedLine
from labkit.logs.read_log import read_killian, read_log
from labkit.logs.trajectories import read_tum, write_g2o, write_tum

__all__ = [
    "Log",
    "SkippedLine",
    "interpolate_poses",
    "read_killian",
    "read_log",
    "read_tum",
    "write_g2o",
    "write_tum",
]
