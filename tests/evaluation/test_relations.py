"""Surveyed relations: exact for the truth, blind to the map's frame; their files in both forms."""

import math
import re

import numpy as np
import pytest

from labkit.errors import InvalidParameterError, InvalidPointsError, LogError
from labkit.evaluation import Relations, read_relations, relation_errors
from labkit.se2 import from_xytheta, relative, to_xytheta

RNG = np.random.default_rng(0)
POSES = np.column_stack([RNG.uniform(-9.0, 9.0, (20, 2)), RNG.uniform(-4.0, 4.0, 20)])
STAMPS = 1000.0 + 0.2 * np.arange(20)
ENDS = np.array([[0, 1], [3, 2], [7, 19], [2, 7]])


def survey(ends=ENDS, by_stamp=False):
    T = from_xytheta(POSES)
    increments = to_xytheta(relative(T[ENDS[:, 0]], T[ENDS[:, 1]]))
    return Relations(ends=ends, by_stamp=by_stamp, increments=increments)


def test_the_truth_has_no_error_in_any_frame():
    moved = to_xytheta(from_xytheta([5.0, 6.0, 2.0]) @ from_xytheta(POSES))
    for poses in (POSES, moved):
        errors = relation_errors(survey(), poses)
        assert errors.translation.max < 1e-13
        assert errors.rotation.max < 1e-13
        assert errors.unmatched == 0
        np.testing.assert_array_equal(errors.pairs, ENDS)


def test_stamps_find_the_nearest_pose_in_any_order():
    order = RNG.permutation(20)
    relations = survey(STAMPS[ENDS] + 0.03, by_stamp=True)
    errors = relation_errors(relations, POSES[order], STAMPS[order])
    assert errors.translation.max < 1e-13
    np.testing.assert_array_equal(order[errors.pairs], ENDS)


def test_an_error_is_the_relation_undone():
    relations = Relations(ends=[[0, 1]], by_stamp=False, increments=[[1.0, 0.0, 0.1]])
    errors = relation_errors(relations, [[0.0, 0.0, 0.0], [1.0, 2.0, -0.2]])
    np.testing.assert_allclose(errors.translation_errors, [2.0])
    np.testing.assert_allclose(errors.rotation_errors, [0.3])


def test_what_the_trajectory_does_not_cover_is_counted():
    by_index = relation_errors(survey(), POSES[:6])
    np.testing.assert_array_equal(by_index.found, [True, True, False, False])
    relations = survey(STAMPS[ENDS], by_stamp=True)
    by_stamp = relation_errors(relations, POSES[:6], STAMPS[:6])
    np.testing.assert_array_equal(by_stamp.found, by_index.found)
    assert by_index.unmatched == by_stamp.unmatched == 2
    assert len(by_stamp) == 2


@pytest.mark.parametrize("beyond", [20, 2.0**31, 2.0**63, 1e19, 1e30, 1e300])
def test_no_index_is_too_large_to_be_missing(beyond):
    ends = np.array([[0, 1], [beyond, 2], [7, beyond], [beyond, beyond]])
    np.testing.assert_array_equal(
        relation_errors(survey(ends), POSES).found, [True, False, False, False]
    )


def test_without_a_match_there_is_no_number():
    relations = survey(STAMPS[ENDS] + 0.1, by_stamp=True)
    errors = relation_errors(relations, POSES, STAMPS, tolerance=0.01)
    assert errors.unmatched == len(relations) == 4
    assert errors.translation.count == 0
    assert math.isnan(errors.translation.mean)


@pytest.mark.parametrize(
    ("stamps", "message"),
    [
        (None, "these relations name times; give the `stamps` of the poses"),
        (STAMPS[:3], r"`stamps` must have shape \(20,\), one per pose, got \(3,\)"),
        ([math.nan] * 20, "`stamps` must be finite, got nan at index 0"),
    ],
)
def test_stamps_that_cannot_be_meant(stamps, message):
    with pytest.raises(InvalidPointsError, match=message):
        relation_errors(survey(STAMPS[ENDS], by_stamp=True), POSES, stamps)


def test_tolerance_out_of_range():
    with pytest.raises(InvalidParameterError, match=r"`tolerance` must be in \[0, inf\] s, got -1"):
        relation_errors(survey(), POSES, tolerance=-1)


@pytest.mark.parametrize(
    ("ends", "message"),
    [
        ([[0, 1]], r"`ends` must be finite and of shape \(4, 2\), one row per increment, got"),
        (ENDS + 0.5, "`ends` must be 0-based scan indices; give by_stamp=True"),
        (ENDS - 1, "`ends` must be 0-based scan indices; give by_stamp=True"),
    ],
)
def test_ends_that_cannot_be_meant(ends, message):
    with pytest.raises(InvalidPointsError, match=message):
        survey(ends)


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
