"""Logs, of which `read_log` reads every format, and trajectories."""

from labkit.logs.log import Content, Log, SkippedLine
from labkit.logs.options import LogOptions
from labkit.logs.read_log import read_log
from labkit.logs.trajectories import interpolate_poses, read_tum, write_tum

__all__ = [
    "Content",
    "Log",
    "LogOptions",
    "SkippedLine",
    "interpolate_poses",
    "read_log",
    "read_tum",
    "write_tum",
]
