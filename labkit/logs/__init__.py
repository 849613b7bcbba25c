"""Reading logs, reading and writing trajectories.

`read_log` reads every log format and recognises it by its content. `stream_log` reads a log
of any length, scan by scan, and `read_points` a single scan.
`write_tum` and `write_g2o` write what was estimated, whole or not at all.
"""

from labkit.logs.g2o import write_g2o
from labkit.logs.log import Log, LogStream, ScanStream, SkippedLine
from labkit.logs.points import read_points
from labkit.logs.read_log import read_killian, read_log, stream_log
from labkit.logs.source import ReadLimits
from labkit.logs.tum import read_tum, write_tum

__all__ = [
    "Log",
    "LogStream",
    "ReadLimits",
    "ScanStream",
    "SkippedLine",
    "read_killian",
    "read_log",
    "read_points",
    "read_tum",
    "stream_log",
    "write_g2o",
    "write_tum",
]
