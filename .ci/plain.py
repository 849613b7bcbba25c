"""Say that numpy, its BLAS and numba take this for a plain processor; fail where one does not."""

import ctypes
from pathlib import Path

import numba
import numpy as np
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

units = [unit for unit in __cpu_dispatch__ if __cpu_features__[unit]]
assert not units, f"numpy uses {units}"
(library,) = Path(np.__file__).parents[1].glob("numpy.libs/libscipy_openblas64_*")
blas = ctypes.CDLL(str(library))
blas.scipy_openblas_get_corename64_.restype = ctypes.c_char_p
core = blas.scipy_openblas_get_corename64_()
assert core == b"Nehalem", f"OpenBLAS uses {core}"
assert numba.config.CPU_NAME == "generic", f"numba compiles for {numba.config.CPU_NAME}"
print("a plain processor for numpy, OpenBLAS and numba")
