"""Ctrl-C at random moments of a parallel run: each time it ends, and no thread is left.

    python tests/bench/ctrl_c.py [ROUNDS]

The suite runs twenty rounds. A run that hangs is ended after a minute, with the stack of
every thread.
"""

import faulthandler
import math
import signal
import sys
import threading
import time
from collections import Counter

import numpy as np

from labkit.odometry import OdometryParameters, estimate_odometry
from labkit.scan import Scan
from labkit.simulation import Lidar, room, scan_along

PATIENCE = 60.0  # [s] for one run to end
AGAINST_SCANS = OdometryParameters(against="scan")  # steps against a map are shared by nobody


def run(scans: list[Scan], path: list[tuple[float, float, float]]) -> None:
    """Match all scans in two threads."""
    estimate_odometry(scans, path, AGAINST_SCANS, jobs=2)


def interrupted(rounds: int) -> Counter[str]:
    """How many runs were stopped, and how many were done before."""
    path = [(0.002 * k, 0.0, 0.0) for k in range(500)]
    scans = list(scan_along(room(), path, Lidar(beam_count=90), rng=0))
    run(scans, path)  # compiles what there is to compile
    whole = math.inf
    for _ in range(3):
        began = time.perf_counter()
        run(scans, path)
        whole = min(whole, time.perf_counter() - began)
    rng = np.random.default_rng(0)
    signal.signal(signal.SIGALRM, signal.default_int_handler)  # as SIGINT
    ends = Counter({"stopped": 0, "threads left": 0})
    for _ in range(rounds):
        faulthandler.dump_traceback_later(PATIENCE, exit=True)
        try:
            signal.setitimer(signal.ITIMER_REAL, rng.uniform(1e-4, whole))
            try:
                run(scans, path)
            finally:
                signal.setitimer(signal.ITIMER_REAL, 0.0)
            ends["done"] += 1
        except KeyboardInterrupt:
            ends["stopped"] += 1
        for thread in threading.enumerate():
            if thread is not threading.main_thread() and thread.is_alive():
                thread.join(PATIENCE / 2)  # it ends the steps that it has begun
                ends["threads left"] += thread.is_alive()
    faulthandler.cancel_dump_traceback_later()
    return ends


if __name__ == "__main__":
    found = interrupted(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
    print(", ".join(f"{count} {name}" for name, count in found.items()))
    sys.exit(found["threads left"] > 0)
