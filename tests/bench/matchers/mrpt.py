"""MRPT's classic ICP, which Debian has and pip has not: apt-get install libmrpt-slam-dev g++.

There are no bindings for Python in Debian; a C++ function of a few lines is compiled when
this module is loaded.
"""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from labkit import from_xytheta, to_xytheta
from labkit.support.arrays import FloatArray

SOURCE = Path(__file__).with_name("mrpt_icp.cpp")
HEADERS = Path("/usr/include/mrpt")
LIBRARIES = ("slam", "maps", "poses", "obs", "tfest", "math", "core")

MAX_ITERATIONS = 60
TOLERANCE = 1e-3  # m and rad
FINEST_GATE = 0.1  # m: the gate is halved at each convergence until it is below


def match(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """Point-to-point under a gate that narrows from coarse to fine."""
    pose = to_xytheta(T_init)
    iterations = LIBRARY.match(
        *_points(source),
        *_points(target),
        ctypes.c_double(gate),
        ctypes.c_double(FINEST_GATE),
        MAX_ITERATIONS,
        ctypes.c_double(TOLERANCE),
        pose.ctypes.data_as(ctypes.c_void_p),
    )
    return from_xytheta(pose), iterations


def _points(points: FloatArray) -> tuple[ctypes.c_void_p, int]:
    return np.ascontiguousarray(points).ctypes.data_as(ctypes.c_void_p), len(points)


def _compile() -> ctypes.CDLL:
    """Build and load the library; an `OSError` says what is missing."""
    if not HEADERS.is_dir():
        raise OSError("libmrpt-slam-dev is not installed")
    includes = [f"-I{path}" for path in HEADERS.glob("*/include")]
    links = [f"-lmrpt-{name}" for name in LIBRARIES]
    with TemporaryDirectory() as folder:
        library = Path(folder) / "mrpt_icp.so"
        compiler = ["g++", "-O2", "-std=c++17", "-shared", "-fPIC", "-I/usr/include/eigen3"]
        built = subprocess.run(
            [*compiler, *includes, str(SOURCE), "-o", str(library), *links],
            capture_output=True,
            text=True,
            check=False,
        )
        if built.returncode:
            raise OSError(f"{SOURCE.name} does not compile: {built.stderr[:200]}")
        return ctypes.CDLL(str(library))


LIBRARY = _compile()
MATCHERS = {"MRPT ICP": match}
