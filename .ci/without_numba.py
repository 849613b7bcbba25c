"""A plugin for pytest: numba is missing, or raises on import; in xdist's processes, too."""

import os
import sys

if os.environ.get("WITHOUT_NUMBA") == "broken":

    class Finder:
        """Finds a numba that does not know this numpy."""

        @staticmethod
        def find_spec(name, path=None, target=None):
            """Refuse numba."""
            if name.partition(".")[0] == "numba":
                raise ImportError("Numba needs NumPy 2.3 or less")

    sys.meta_path.insert(0, Finder)
else:
    sys.modules["numba"] = None
