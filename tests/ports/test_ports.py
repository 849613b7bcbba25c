"""The ports against the vectors, with planted faults, under sanitisers, on bad input.

Slow, for compilers and Mathics3 are; buys that all languages give one set of answers. Every
answer of a port comes from one process. Without its tools a port is skipped, but not under
CI, which has all of them.
"""

import json
import math
import os
import re
from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.ports.bad_input import BAD_COMMANDS, write_bad_files
from tests.ports.borders import verdicts
from tests.ports.faults import FAULTS, UNTOUCHED, planted
from tests.ports.ports import PORTS, build_cpp_sanitised, execute
from tests.ports.runner import GROUPS, VECTORS, reasons

pytestmark = [pytest.mark.slow, pytest.mark.others]
BY_NAME = {port.name: port for port in PORTS}
EACH_PORT = pytest.mark.parametrize("name", list(BY_NAME))
SLOW_TO_START = {"wolfram"}  # 4 s a start: one is enough
ALONE = (  # one of each kind; all of them are asked in a batch
    ("match", "missing.csv", "good.csv", "good.json"),
    ("match", "nan.csv", "good.csv", "good.json"),
    ("match", "good.csv", "good.csv", "cut.json"),
    ("integrate", "good3.csv", "0", "north", "0"),
    ("align",),
    ("dance", "good.csv"),
)
TELLING_BORDERS = (  # for those: one of each kind
    "match scan.csv crlf.csv defaults.json",
    "match scan.csv many_exp.csv defaults.json",
    "match scan.csv bom.csv defaults.json",
    "match scan.csv blank_middle.csv defaults.json",
    "match scan.csv blank_end.csv defaults.json",
    "match scan.csv trailing_comma.csv defaults.json",
    "match scan.csv huge_number.csv defaults.json",
    "match scan.csv hex.csv defaults.json",
    "match scan.csv folder defaults.json",
    "align mixed.csv",
    "align weight_neg.csv",
    "match scan.csv scan.csv gate_null.json",
    "match scan.csv scan.csv bom.json",
    "match scan.csv scan.csv dup.json",
    "match scan.csv scan.csv nan.json",
    "match scan.csv scan.csv nbsp.json",
    "demo 4294967296",
)


def usable(name):
    """The port; without its tools the test ends here."""
    port = BY_NAME[name]
    if port.missing and os.environ.get("CI"):
        pytest.fail(port.missing)
    if port.missing:
        pytest.skip(port.missing)
    return port


@pytest.fixture(scope="session")
def workshop(request, tmp_path_factory):
    """The folder of each port that is built, and all its answers, as a promise.

    All ports that this session tests begin at once, the slowest first.
    """
    folder = tmp_path_factory.mktemp("ports")
    ids = " ".join(item.name for item in request.session.items)
    with ThreadPoolExecutor(2) as pool:
        promises = {
            name: pool.submit(reasons, BY_NAME[name], folder / name / "whole")
            for name in ("wolfram", "cpp", "java", "matlab")
            if name in ids and BY_NAME[name].missing is None
        }
        yield folder, promises


@pytest.mark.parametrize("group", GROUPS)
@EACH_PORT
def test_agreement(workshop, name, group):
    usable(name)
    column = workshop[1][name].result()
    asked = {v["name"] for v in VECTORS if v["group"] == group} & column.keys()
    assert asked
    assert not {vector: column[vector] for vector in asked if column[vector]}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: f"{fault.port}-{fault.name}")
def test_a_planted_fault_turns_the_column_red(workshop, tmp_path, fault):
    """One vector goes red, not both: a program that crashed would not be caught, but broken."""
    port = usable(fault.port)
    folder, promises = workshop
    assert not any(promises[port.name].result().values())
    copy = planted(fault, port.sources, tmp_path / "sources")
    built = folder / port.name / fault.name
    column = reasons(port, built, copy, (fault.red, UNTOUCHED))
    assert column[fault.red] is not None
    assert column[UNTOUCHED] is None


def test_cpp_is_clean_under_sanitisers(workshop):
    """Slow (a build of its own): no overflow, stray index or leak on any vector."""
    port = usable("cpp")
    column = reasons(port, workshop[0] / "cpp" / "sanitised", build=build_cpp_sanitised)
    assert not {vector: why for vector, why in column.items() if why}


# ---------------------------------------------------------------- bad input


def start(workshop, name, arguments, where):
    port = usable(name)
    folder, promises = workshop
    promises[name].result()  # so that it is built
    words = [*port.start(port.sources, folder / name / "whole"), *arguments]
    return execute(words, cwd=where)


@EACH_PORT
def test_bad_input_alone(workshop, tmp_path, name):
    write_bad_files(tmp_path)
    for bad in ALONE[: 1 if name in SLOW_TO_START else None]:
        outcome = start(workshop, name, bad, tmp_path)
        assert outcome.returncode != 0
        assert outcome.stdout == ""
        (line,) = outcome.stderr.splitlines()
        assert line.startswith("icp2d: ")
        assert re.search(BAD_COMMANDS[bad], line)


@EACH_PORT
def test_bad_input_in_a_batch(workshop, tmp_path, name):
    """Each has its own error, and the commands between them go on."""
    write_bad_files(tmp_path)
    good = "integrate good3.csv 0 0 0"
    lines = [line for bad in BAD_COMMANDS for line in (" ".join(bad), good)]
    (tmp_path / "commands.txt").write_text("\n".join(lines) + "\n")
    outcome = start(workshop, name, ["batch", tmp_path / "commands.txt"], "/")
    assert outcome.returncode == 0
    answers = [json.loads(line) for line in outcome.stdout.splitlines()]
    assert len(answers) == len(lines)
    for bad, answer, after in zip(BAD_COMMANDS, answers[::2], answers[1::2], strict=True):
        assert answer.keys() == {"error"}, bad
        assert re.search(BAD_COMMANDS[bad], answer["error"])
        assert after == {"poses": [[0, 0, 0], [1, 2, 0.5]]}


@EACH_PORT
def test_the_verdict_on_every_border_file_is_the_same(workshop, tmp_path, name):
    """CRLF, BOM, blank lines, 1e400, double keys, wrong types, folders: accept or refuse alike."""
    expected = verdicts(tmp_path)
    if name in SLOW_TO_START:
        expected = {command: expected[command] for command in TELLING_BORDERS}
    (tmp_path / "commands.txt").write_text("".join(f"{command}\n" for command in expected))
    outcome = start(workshop, name, ["batch", tmp_path / "commands.txt"], "/")
    assert outcome.returncode == 0, outcome.stderr
    answers = [json.loads(line) for line in outcome.stdout.splitlines()]
    accepted = {c: "error" not in a for c, a in zip(expected, answers, strict=True)}
    assert {c for c in expected if accepted[c] != expected[c]} == set()


@EACH_PORT
def test_the_demo_finds_its_truth(workshop, tmp_path, name):
    outcome = start(workshop, name, ["demo", *BY_NAME[name].demo], tmp_path)
    assert outcome.returncode == 0, outcome.stderr
    answer = json.loads(outcome.stdout)
    x, y, theta = (a - b for a, b in zip(answer["estimate"], answer["truth"], strict=True))
    assert math.hypot(x, y) < 0.02
    assert abs(theta) < 0.01
    assert answer["termination"].startswith("converged")
