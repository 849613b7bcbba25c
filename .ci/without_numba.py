"""A plugin for pytest: numba cannot be imported, in this process and in those of xdist."""

import sys

sys.modules["numba"] = None
