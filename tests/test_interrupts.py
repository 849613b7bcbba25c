"""An interrupt at any moment ends as KeyboardInterrupt, and in nothing else."""

import os
import subprocess
import sys

import pytest

# A child is interrupted at random moments, beside a second thread, as a kernel of JupyterLab is.
CHILD = """
import logging, random, signal, threading
logging.disable()  # of the compiler, where the stages are new
import numpy as np, labkit
from labkit.odometry import estimate_odometry
from labkit.odometry.search import search
from labkit.simulation import room, Lidar, scan_along

def spin():
    while True:
        sum(range(100))

path = np.column_stack([0.1 * np.arange(8), np.zeros(8), 0.05 * np.arange(8)])
scans = list(scan_along(room(), path, Lidar(beam_count=181), rng=1))
target = labkit.Target(scans[0])
wide = labkit.IcpParameters(metric="point_to_line", approach=True, huber_delta=0.03)

def icp():
    for parameters in (labkit.IcpParameters(), wide):
        result = labkit.icp(scans[5].points, scans[0].points, None, parameters)
        result.history, result.observability, target.search.query(scans[1].points)

def odometry():
    estimate_odometry(scans)

def windows():
    search(scans[5], target, np.eye(3), (1.0, 0.5))

{0}()
threading.Thread(target=spin, daemon=True).start()
signal.signal(signal.SIGALRM, signal.default_int_handler)
draw = random.Random(0)
for count in range({1}):
    try:
        signal.setitimer(signal.ITIMER_REAL, draw.uniform(1e-4, 0.03))
        while True:
            {0}()
    except KeyboardInterrupt:
        pass
print("interrupted", count + 1)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no timer that interrupts")
@pytest.mark.parametrize(
    "what",
    ["icp", *(pytest.param(name, marks=pytest.mark.nightly) for name in ("odometry", "windows"))],
)
def test_an_interrupt_is_a_keyboard_interrupt(what):
    """The law: every function that is compiled × every moment of it."""
    program = CHILD.format(what, 40)
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "interrupted 40\n"


# The child interrupts its first call ever later, until that call is done: at each moment numba is
# imported, compiles, or keeps what it compiled.
COMPILING = """
import logging, signal
logging.disable()
import numpy as np
from labkit.neighbors import NearestNeighbors

points = np.random.default_rng(0).uniform(0.0, 5.0, (50, 2))
signal.signal(signal.SIGALRM, signal.default_int_handler)
count, done = 0, False
while not done:
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1 + 0.05 * count)
        index, _ = NearestNeighbors(points).query(points)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        done = True
    except KeyboardInterrupt:
        count += 1
assert (index == np.arange(50)).all()
print("interrupted", count > 0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no timer that interrupts")
def test_an_interrupt_while_compiling_spoils_no_function(tmp_path):
    """The law: interrupted at every moment of compiling, the same call works later."""
    done = subprocess.run(
        [sys.executable, "-c", COMPILING],
        env=os.environ | {"LABKIT_CACHE": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "interrupted True\n"
