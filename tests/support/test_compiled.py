"""Compiled stages: kept on disk, healed where the disk lied, and run by Python without numba."""

import itertools
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import labkit
from labkit.icp import icp, minimise
from labkit.support.compiled import compiled_signatures, load_numba

NEEDS_NUMBA = pytest.mark.skipif(load_numba() is None, reason="numba is not to be had")
ASKED = "from labkit.neighbors import cell_index; print(cell_index(8.5, 10))"
NO_FILES = (
    "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
    "resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)); "
)


def answer(cache, program=ASKED):
    """What a new process prints, and what it says beside."""
    variables = os.environ | {"LABKIT_CACHE": str(cache), "PYTHONWARNINGS": "error"}
    done = subprocess.run(
        [sys.executable, "-c", program], env=variables, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "8\n"
    return done.stderr


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """A cache with one stage in it."""
    folder = tmp_path_factory.mktemp("cache")
    assert "compiling the matcher for this computer, once" in answer(folder)
    assert answer(folder) == ""
    return folder


@NEEDS_NUMBA
@pytest.mark.parametrize("change", [{"NUMBA_CPU_NAME": "generic"}, None], ids=["CPU", "interrupt"])
def test_the_line_stands_wherever_numba_compiles(cache, change, monkeypatch):
    """On another processor, and after a first run that was interrupted; once a process."""
    if change is None:
        for file in cache.rglob("*.nb?"):
            file.unlink()
    for name, value in (change or {}).items():
        monkeypatch.setenv(name, value)

    said = answer(cache)

    assert said.count("compiling the matcher for this computer, once") == 1
    assert answer(cache) == ""


def test_a_notebook_shows_the_line_as_output_and_not_as_a_fault(monkeypatch, capsys):
    code_cache = pytest.importorskip("labkit.support.code_cache")
    monkeypatch.setitem(sys.modules, "ipykernel", sys)

    code_cache.tell_of_compiling.__wrapped__()

    shown = capsys.readouterr()
    assert "compiling the matcher" in shown.out
    assert shown.err == ""


@NEEDS_NUMBA
def test_the_cache_may_lie_at_home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    answer("~/stages")
    assert list((tmp_path / "stages").rglob("*.nbi"))


@NEEDS_NUMBA
def test_a_copy_of_the_lab_compiles_nothing_anew(cache, tmp_path):
    shutil.copytree(Path(labkit.__file__).parent, tmp_path / "labkit")
    place = repr(str(tmp_path))
    from_there = f"import sys; sys.path.insert(0, {place}); import labkit; "
    is_there = f"assert labkit.__file__.startswith({place}); "

    assert answer(cache, from_there + is_there + ASKED) == ""


DAMAGES = {  # to the index, and to the code that a whole index leads to
    ".nbi": lambda content: content[: len(content) // 2],
    ".nbc": lambda content: content[:-99] + bytes([content[-99] ^ 1]) + content[-98:],
}


@NEEDS_NUMBA
@pytest.mark.parametrize("kind", [".nbc", pytest.param(".nbi", marks=pytest.mark.nightly)])
def test_a_damaged_file_is_compiled_anew(cache, kind):
    (file,) = (file for file in cache.rglob("*.nb?") if file.suffix == kind)
    whole = file.read_bytes()
    file.write_bytes(DAMAGES[kind](whole))
    answer(cache)
    assert len(file.read_bytes()) == pytest.approx(len(whole), rel=0.1)
    assert file.read_bytes()[-99:] != DAMAGES[kind](whole)[-99:]


@NEEDS_NUMBA
@pytest.mark.nightly
def test_where_nothing_can_be_kept_each_process_compiles(tmp_path):
    (tmp_path / "file").write_text("no folder")
    said = answer(tmp_path / "file")
    assert said.startswith("compiling the matcher in every process, 10 s or more: ")
    assert said.count("\n") == 1


@NEEDS_NUMBA
@pytest.mark.nightly
@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit on the size of files")
def test_a_full_disk_is_told_and_stops_nobody(tmp_path):
    said = answer(tmp_path, NO_FILES + ASKED)
    assert "the compiled matcher cannot be kept: " in said
    assert not [file for file in tmp_path.rglob("*") if file.is_file() and file.stat().st_size]


@NEEDS_NUMBA
def test_the_cache_follows_only_files_with_stages(tmp_path, monkeypatch):
    from labkit.support import code_cache  # noqa: PLC0415 (imports numba)

    monkeypatch.setattr(code_cache, "SOURCES", tmp_path)
    stage, plain = tmp_path / "stage.py", tmp_path / "plain.py"
    stage.write_text("\n@compiled\ndef f(): ...\n")
    plain.write_text("# nothing\n")
    before = code_cache.fingerprint()
    plain.write_text("# another comment\n")
    assert code_cache.fingerprint() == before
    stage.write_text("\n@compiled\ndef g(): ...\n")
    assert code_cache.fingerprint() != before


@pytest.mark.parametrize("how", ["None", "Broken()"])
def test_without_numba_python_runs_the_same_function(tmp_path, how):
    broken = (
        "import sys\n"
        "class Broken:\n"
        "    def __getattr__(self, name): raise ImportError('Numba needs NumPy 2.3 or less')\n"
        f"sys.modules['numba'] = {how}\n"
    )
    match = (
        "import labkit, numpy as np; p = np.random.default_rng(0).uniform(0.0, 2.0, (60, 2)); "
        "lines = labkit.IcpParameters(metric='point_to_line', approach=True, huber_delta=0.02); "
        "print(labkit.icp(p, p).inlier_count - labkit.icp(p, p, None, lines).iterations - 41)"
    )
    said = answer(tmp_path, broken + match)
    assert said.startswith("Python runs the matcher, slowly: ")
    assert said.count("\n") == 1


def test_in_a_browser_python_runs_the_stages_without_a_thread(tmp_path):
    browser = (
        "import sys, threading; sys.modules['numba'] = None\n"
        "import labkit, numpy as np, scipy.spatial\n"
        "def refuse(self): raise RuntimeError('can\\'t start new thread')\n"
        "sys.platform = 'emscripten'; threading.Thread.start = refuse\n"
    )
    match = (
        "p = np.random.default_rng(0).uniform(0.0, 2.0, (60, 2)); "
        "print(labkit.icp(p, p).inlier_count - 43)"
    )

    said = answer(tmp_path, browser + match)

    assert said.startswith("Python runs the matcher, slowly: ")


def test_all_stages_can_be_compiled_ahead():
    """As each `make` does, once an environment is set up: each for one kind of arguments."""
    program = (  # in a process of its own, where no other test has called them
        "from labkit.support.compiled import compiled_signatures; "
        "from labkit.support.warm import warm; warm(); "
        "several = {name: each for name, each in compiled_signatures().items() if len(each) > 1}; "
        "assert not several, several; print(8)"
    )
    answer(os.environ.get("LABKIT_CACHE", ""), program)


@NEEDS_NUMBA
def test_a_match_loads_no_scipy_linalg():
    """numba's own arrays ask for a BLAS, which takes a third of the first match."""
    program = (
        "import sys, labkit; p = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 3.0]]; "
        "labkit.icp(p, p, metric='point_to_line'); labkit.align(p, p); "
        "assert 'scipy.linalg' not in sys.modules; import scipy.linalg; print(8)"
    )
    answer(os.environ.get("LABKIT_CACHE", ""), program)


IMPORT_BESIDE = """
import importlib, sys, threading
def import_beside(event, arguments):
    if event == "open" and "arraymath" in str(arguments[0]) and not threads:
        work = lambda: found.append(importlib.import_module("scipy.linalg"))
        threads.append(threading.Thread(target=work))
        threads[0].start()
        threads[0].join()
found = []
threads = []
sys.addaudithook(import_beside)
from labkit.support.compiled import load_numba
load_numba()
from numba.np import arraymath, linalg
assert found, "another thread cannot import scipy.linalg"
assert arraymath._HAVE_BLAS and linalg.ensure_blas.__name__ == "ensure_blas"
print(8)
"""


@NEEDS_NUMBA
def test_what_other_code_imports_while_numba_loads_is_whole(tmp_path):
    """A thread may import `scipy.linalg` at any moment, and numba finds its BLAS afterwards."""
    assert answer(tmp_path, IMPORT_BESIDE) == ""


def test_arrays_of_any_kind_compile_nothing_anew(in_the_room):
    """Writable or not, of either layout, with gaps in memory, of single precision, or a list."""
    points = in_the_room.source.points
    kinds = [
        points.copy(),
        np.asfortranarray(points),
        np.repeat(points, 2, axis=0)[::2],
        points.astype(np.float32),
        points.tolist(),
    ]
    _ = icp(points, points, metric="point_to_line").cost
    before = compiled_signatures()

    for source, target in itertools.product(kinds, kinds):
        _ = icp(source, target, np.eye(3).T, metric="point_to_line").cost

    signatures = compiled_signatures()
    assert {name: signatures[name] for name in before} == before


def test_what_is_unpickled_compiles_nothing_anew(in_the_room):
    """A worker process gets a target, a result and pairs whose arrays are read-only, as here."""
    result = icp(in_the_room.source, in_the_room.target, metric="point_to_line")
    minimise(result.correspondences)
    before = compiled_signatures()

    sent = pickle.loads(pickle.dumps(result))
    again = icp(sent.source, sent.target, metric="point_to_line")
    minimise(pickle.loads(pickle.dumps(result.correspondences)))

    np.testing.assert_array_equal(again.poses, sent.poses)
    assert len(sent.history) == len(result.history)
    assert sent.cost == result.cost
    signatures = compiled_signatures()
    assert {name: signatures[name] for name in before} == before
