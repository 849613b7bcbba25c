"""Files of relations: both forms, and what a damaged line says."""

import re

import numpy as np
import pytest

from labkit.errors import LogError
from labkit.evaluation import read_relations

TABLE = """\
# surveyed by hand
i,j,dx,dy,dtheta
193,194,-0.016980,0.059550,0.497670

105,106,-0.004880, 0.057600,0.540760  # a comment
"""
BENCHMARK = """\
# t1 t2 x y z roll pitch yaw
976052857.25 976052859.50 0.5 -0.25 0.000000 0.000000 -0.000000 0.125
976052860.00\t976052861.75  1.5 2.0 0 0 0 -3.0
"""
INDICES = "scan indices must be whole numbers from 0 to 999999999"


@pytest.fixture
def read(tmp_path):
    def write_and_read(text):
        path = tmp_path / "survey.relations"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_relations(path)

    return write_and_read


def test_a_table_of_indices(read):
    relations = read(TABLE)
    assert not relations.by_stamp
    np.testing.assert_array_equal(relations.ends, [[193, 194], [105, 106]])
    np.testing.assert_array_equal(
        relations.increments, [[-0.01698, 0.05955, 0.49767], [-0.00488, 0.0576, 0.54076]]
    )


def test_the_benchmarks_form(read):
    relations = read(BENCHMARK)
    assert relations.by_stamp
    np.testing.assert_array_equal(
        relations.ends, [[976052857.25, 976052859.5], [976052860.0, 976052861.75]]
    )
    np.testing.assert_array_equal(relations.increments, [[0.5, -0.25, 0.125], [1.5, 2.0, -3.0]])


def test_line_ends_and_the_header_are_free(read):
    np.testing.assert_array_equal(
        read(TABLE.replace("\n", "\r\n")).increments, read(TABLE).increments
    )
    without_header = TABLE.replace("i,j,dx,dy,dtheta\n", "")
    np.testing.assert_array_equal(read(without_header).ends, read(TABLE).ends)


@pytest.mark.parametrize(
    "text", [TABLE, TABLE.split("\n", 1)[1], TABLE.split("\n", 2)[2], BENCHMARK]
)
def test_a_byte_order_mark_is_no_part_of_the_first_line(read, text):
    marked = read(b"\xef\xbb\xbf" + text.encode())
    np.testing.assert_array_equal(marked.ends, read(text).ends)
    np.testing.assert_array_equal(marked.increments, read(text).increments)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("1,2,0.5,0.5", "expected 5 fields, got 4"),
        ("1,2,0.5,0.5,0.5,0.5", "expected 5 fields, got 6"),
        ("1 2 0.5 0.5 0.5", "expected 5 fields, got 1"),
        ("1,2,0.5,half,0.5", "could not convert string to float: 'half'"),
        ("1,2,0.5,,0.5", "could not convert string to float: ''"),
        ("1,2,0.5,nan,0.5", "numbers must be finite, got"),
        ("1.5,2,0.5,0.5,0.5", f"{INDICES}, got '1.5,2,"),
        ("-1,2,0.5,0.5,0.5", f"{INDICES}, got '-1,2,"),
        ("1e30,2,0.5,0.5,0.5", f"{INDICES}, got '1e30,2,"),
        ("1,1e19,0.5,0.5,0.5", f"{INDICES}, got '1,1e19,"),
        ("1,1000000000,0.5,0.5,0.5", f"{INDICES}, got '1,1000000000,"),
        ("1,2,0.5,-1e300,0.5", "relations must lie within 1e+09 m and rad, got '1,2,"),
        ("1,2,0.5,0.5,1e10", "relations must lie within 1e+09 m and rad, got '1,2,"),
        ("i,j,dx,dy,dtheta", "could not convert string to float: 'i'"),
    ],
)
def test_a_damaged_line_of_a_table_is_named(read, line, complaint):
    with pytest.raises(LogError, match=rf"survey\.relations:6: {re.escape(complaint)}"):
        read(TABLE + line + "\n")


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("1 2 0.5 0.5 0 0 0", "expected 8 fields, got 7"),
        ("1 2 0.5 0.5 0 0 0 x", "could not convert string to float: 'x'"),
        ("1 2 0.5 0.5 0 0 0 inf", "numbers must be finite, got"),
        ("1 2 1e10 0.5 0 0 0 0", "relations must lie within 1e+09 m and rad, got '1 2"),
        ("1 2 0.5 0.5 0 0 0 -1e10", "relations must lie within 1e+09 m and rad, got '1 2"),
        ("1 2 0.5 0.5 0.2 0 0 0", "z, roll and pitch must be 0 in the plane, got '1 2"),
        ("1 2 0.5 0.5 0 0 -0.2 0", "z, roll and pitch must be 0 in the plane, got '1 2"),
    ],
)
def test_a_damaged_line_of_the_benchmark_is_named(read, line, complaint):
    with pytest.raises(LogError, match=rf"survey\.relations:4: {re.escape(complaint)}"):
        read(BENCHMARK + line + "\n")


def test_bytes_that_are_no_text_are_a_damaged_line(read):
    with pytest.raises(LogError, match=r"survey\.relations:1: "):
        read(b"\xff\xfe\x00\x01")


@pytest.mark.parametrize("text", ["", "# nothing here\n", "i,j,dx,dy,dtheta\n"])
def test_a_file_without_relations(read, text):
    with pytest.raises(LogError, match=r"survey\.relations: holds no relations"):
        read(text)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(LogError, match=r"gone\.csv: cannot be read: No such file"):
        read_relations(tmp_path / "gone.csv")
