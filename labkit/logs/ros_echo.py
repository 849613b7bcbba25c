"""Tables of ``ros2 topic echo --csv``: the fields of a message in their order, without titles.

::

    sec, nanosec, frame_id, angle_min, angle_max, angle_increment, time_increment, scan_time,
    range_min, range_max, ranges…, intensities…                          (LaserScan)

    sec, nanosec, frame_id, child_frame_id, x, y, z, qx, qy, qz, qw, …   (Odometry)
"""

from __future__ import annotations

from functools import partial

from labkit.logs.columns import DECLARED, SECONDS, split_row
from labkit.logs.lines import is_number, parse_numbers
from labkit.logs.log import Content
from labkit.logs.ranges import FEWEST_BEAMS, Layout, parse_sweep
from labkit.logs.ranges import READER as RANGES
from labkit.logs.reader import Reader, Reading, Source, Sweep
from labkit.logs.scanner import Scanner
from labkit.logs.wheels import read_table, titled
from labkit.support.arrays import FloatArray

HEADER = 10  # fields of a LaserScan before its ranges
STAMP = ((0, 1.0), (1, SECONDS["ns"]))
FIELDS = {name: (k, 1.0) for name, k in zip(DECLARED, (3, 4, 5, 6, 8, 9), strict=True)}
ODOMETRY = "sec,nanosec,frame_id,child_frame_id,x,y,z,qx,qy,qz,qw"


def read(source: Source) -> Reading:
    """Read a sweep of each printed LaserScan."""
    sweeps = source.sweeps(
        source.parse(partial(_parse_scan, scanner=source.scanner), source.lines())
    )
    contents = [Content("sensor_msgs/LaserScan", f"{len(sweeps)} messages", "scans")]
    return Reading(sweeps=sweeps, clock_is_named=True, contents=contents)


def _parse_scan(number: int, text: str, scanner: Scanner) -> Sweep | None:
    row = split_row(text)
    if not row:
        return None
    first, last, step = parse_numbers(row[3:6], "angle")
    count = _beam_count(len(row) - HEADER, first, last, step)
    layout = Layout(
        width=len(row),
        beams=range(HEADER, HEADER + count),
        scale=1.0,
        clocks=STAMP,
        declared=FIELDS,
        frame=2,
    )
    return parse_sweep(number, row, layout=layout, scanner=scanner)


def _beam_count(count: int, first: float, last: float, step: float) -> int:
    """Number of ranges in front of intensities: all fields, or half of them."""
    if step == 0.0 or count % 2:
        return count
    declared = abs(last - first) / abs(step)
    return count if abs(count - declared) <= abs(count / 2 - declared) else count // 2


def read_wheels(source: Source) -> FloatArray:
    """Rows (t [s], x [m], y [m], θ [rad]) of printed messages of Odometry."""
    width = len(next(iter(source.table.rows), []))
    return read_table(source, titled(ODOMETRY + "," * (width - ODOMETRY.count(",") - 1)))


def _is_echo(source: Source) -> bool:
    """Recognise a stamp in two whole numbers, the word of a frame, and more numbers."""
    row = next(iter(source.table.rows), [])
    is_message = len(row) >= HEADER + FEWEST_BEAMS and row[0].isdigit() and row[1].isdigit()
    return is_message and not is_number(row[2]) and all(map(is_number, row[4:]))


READER = Reader(
    name="ros_echo",
    files="what `ros2 topic echo --csv` prints",
    recognises=_is_echo,
    uses=RANGES.uses,
    read=read,
    read_wheels=read_wheels,
)
