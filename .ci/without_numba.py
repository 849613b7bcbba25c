"""A plugin for pytest: numba raises on import, as beside a numpy that it does not know."""

import sys


class Finder:
    """Finds no numba."""

    @staticmethod
    def find_spec(name, path=None, target=None):
        """Refuse numba."""
        if name.partition(".")[0] == "numba":
            raise ImportError("Numba needs NumPy 2.3 or less")


sys.meta_path.insert(0, Finder)


def pytest_sessionstart():
    """Fail where labkit finds one all the same; xdist's workers load this plugin, too."""
    from labkit.support.compiled import load_numba  # noqa: PLC0415 (once numba is hidden)

    assert load_numba() is None
    print("numba raises on import here")
