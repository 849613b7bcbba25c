"""The engine gives the textbook's answers: over scans, parameters, metrics and endings."""

import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from labkit import IcpParameters, Scan, Target, Termination, icp, transform
from labkit.neighbors import nearest_by_brute_force
from labkit.normals import estimate_normals
from labkit.odometry import OdometryParameters
from labkit.simulation import Lidar, cast, corridor, room

pytest.importorskip("numba", reason="needs numba: pip install numba")
from labkit.engine import loop, match_pairs, matching, nearest_rows, warm
from labkit.engine.jit import user_cache

ODOMETRY = OdometryParameters().icp


def assert_same(source, target, guess, parameters, normals=None):
    """Pose to 1e-9, everything else that is counted exactly; twice, for what the target keeps."""
    expected = icp(source, Target(target, normals), guess, parameters, engine="textbook")
    prepared = Target(target, normals)
    for _ in range(3):
        result = icp(source, prepared, guess, parameters, engine="compiled")
        assert result.termination is expected.termination
        assert result.iterations == expected.iterations
        assert result.inlier_count == expected.inlier_count
        assert result.fitness == expected.fitness
        np.testing.assert_array_equal(result.far, expected.far)
        np.testing.assert_allclose(result.poses, expected.poses, atol=1e-9)
        np.testing.assert_allclose(result.inlier_rmse, expected.inlier_rmse, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(result.cost, expected.cost, rtol=1e-9, atol=1e-15)


@st.composite
def scans(draw):
    """Two looks at a room or a corridor, or two clouds; in beam order or bare."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = draw(st.sampled_from(["room", "corridor", "cloud"]))
    if kind == "cloud":
        counts = draw(st.tuples(st.integers(1, 60), st.integers(1, 300)))
        return tuple(Scan.from_points(rng.uniform(-3.0, 3.0, (count, 2))) for count in counts)
    world = room() if kind == "room" else corridor()
    lidar = Lidar(beam_count=draw(st.sampled_from([30, 181, 360])))
    T = transform(*rng.uniform(-0.2, 0.2, 3))
    target, source = (cast(world, pose, lidar, rng=rng) for pose in (np.eye(3), T))
    if draw(st.booleans()):
        source, target = (
            Scan.from_points(rng.permutation(each.points)) for each in (source, target)
        )
    return source, target


parameter_sets = st.builds(
    IcpParameters,
    max_correspondence_distance=st.sampled_from([0.05, 0.5, 2.0, math.inf]),
    overlap_ratio=st.sampled_from([0.3, 0.7, 0.85, 1.0]),
    huber_delta=st.sampled_from([0.02, 0.2, math.inf]),
    max_iterations=st.sampled_from([1, 4, 60]),
    translation_tolerance=st.sampled_from([0.0, 1e-6, 3e-3]),
    rotation_tolerance=st.sampled_from([0.0, 1e-6, 7.5e-4]),
    cost_tolerance=st.sampled_from([0.0, 1e-12, 1e-4]),
    metric=st.sampled_from(["point_to_point", "point_to_line"]),
    step_fraction=st.sampled_from([1.0, 0.5]),
    approach=st.booleans(),
)
guesses = st.builds(transform, st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-0.3, 0.3))


@settings(max_examples=300)
@given(scans(), guesses, parameter_sets)
def test_both_give_the_same_answers(pair, guess, parameters):
    assert_same(*pair, guess, parameters)


@pytest.mark.parametrize("metric", ["point_to_point", "point_to_line"])
@pytest.mark.parametrize("name", ["odometry", "lesson"])
def test_both_give_the_same_answers_on_a_real_log(name, metric, killian):
    parameters = replace(ODOMETRY if name == "odometry" else IcpParameters(), metric=metric)
    for k in range(0, 3800, 190):
        assert_same(killian.scans[k + 1], killian.scans[k], transform(0.3, 0.0, 0.0), parameters)


def test_a_target_of_several_scans_brings_its_normals(killian):
    older = killian.scans[:3]
    points = np.vstack([scan.points for scan in older])
    normals = np.vstack([estimate_normals(scan) for scan in older])
    assert_same(killian.scans[3], points, np.eye(3), ODOMETRY, normals)


def test_every_ending_is_reached_by_both():
    """The endings that the tests of the loop provoke, so that none hides behind another."""
    rng = np.random.default_rng(0)
    cloud, spot = rng.uniform(-3.0, 3.0, (40, 2)), np.tile([0.1, 0.9], (9, 1))
    sparse = 3.0 * np.stack(np.meshgrid(np.arange(5.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    near = transform(0.01, 0.0, 0.01)
    by_line = IcpParameters(metric="point_to_line")
    for source, target, guess, parameters, ending in (
        (cloud, cloud, near, IcpParameters(), Termination.CONVERGED_POSE),
        (cloud, cloud + 0.1, near, IcpParameters(cost_tolerance=1.0), Termination.CONVERGED_COST),
        (cloud, cloud + 0.1, near, IcpParameters(max_iterations=1), Termination.BUDGET_SPENT),
        (cloud, cloud, transform(99, 0, 0), IcpParameters(), Termination.TOO_FEW_CORRESPONDENCES),
        (spot, spot, near, IcpParameters(), Termination.DEGENERATE),
        (sparse, sparse, near, by_line, Termination.DEGENERATE),
    ):
        assert icp(source, target, guess, parameters, engine="compiled").termination is ending
        assert_same(source, target, guess, parameters)


@pytest.mark.parametrize("metric", ["point_to_point", "point_to_line"])
def test_both_give_the_same_answers_where_a_tree_is_asked(metric):
    """Two crowds in a room, bare: their points are asked for leaf by leaf."""
    rng, crowds = np.random.default_rng(7), np.repeat([[-1.0, 0.5], [1.0, -0.5]], 600, axis=0)
    source, target = (
        np.vstack([scene("walls", rng, 300), rng.normal(crowds, 2e-3)]) for _ in range(2)
    )
    assert loop.prepare(target, False, False).search.depth > 0
    assert_same(source, target, transform(0.02, -0.01, 0.02), replace(ODOMETRY, metric=metric))


# ---------------------------------------------------------------- normals


@pytest.mark.parametrize("name", ["walls", "scatter", "a few at 80 m", "dense", "one spot"])
@pytest.mark.parametrize("count", [3, 40, 500, 5000])
def test_normals_in_space_are_the_textbooks(name, count):
    points = scene(name, np.random.default_rng(count), count)
    expected = estimate_normals(Scan.from_points(points))
    result = loop.prepare(points, False, True).normals
    np.testing.assert_allclose(result, expected, atol=1e-9)


@pytest.mark.parametrize("crowd", [0, 1000])
@pytest.mark.parametrize("on_the_line", [True, False])
def test_of_equally_far_neighbours_the_first_belongs_to_a_normal(crowd, on_the_line):
    """The seventh neighbour of the origin: one on the line, or one as far beside it."""
    line = np.column_stack([[0.0, -0.2, -0.1, 0.05, 0.1, 0.2], np.zeros(6)])
    tie = [[0.3, 0.0], [0.0, 0.3]] if on_the_line else [[0.0, 0.3], [0.3, 0.0]]
    far = np.random.default_rng(0).normal(np.repeat([[5.0], [9.0]], crowd, axis=0), 1e-3)
    prepared = loop.prepare(np.vstack([line, tie, np.tile(far, 2)]), False, True)
    assert (prepared.search.depth > 0) == (crowd > 0)
    assert np.allclose(np.abs(prepared.normals[0]), [0.0, 1.0]) == on_the_line


# ---------------------------------------------------------------- nearest neighbours

# On a coarse lattice ties and duplicates are the rule.
lattice = arrays(
    float,
    st.tuples(st.integers(1, 40), st.just(2)),
    elements=st.integers(-3, 3).map(lambda k: 0.5 * k),
)
clouds = arrays(float, st.tuples(st.integers(1, 40), st.just(2)), elements=st.floats(-1e3, 1e3))


def scene(name, rng, count):
    """Points as a scanner, a careless user or an enemy of grids would have them."""
    if name == "walls":
        return cast(room(), np.eye(3), Lidar(beam_count=count, field_of_view=4.7), rng=rng).points
    if name == "scatter":
        return rng.uniform(-4.0, 4.0, (count, 2))
    if name == "one far off":
        return np.vstack([rng.uniform(-4.0, 4.0, (count - 1, 2)), [[1e9, -1e9]]])
    if name == "a few at 80 m":
        return np.where(rng.random((count, 1)) < 0.03, 80.0, 1.0) * rng.normal(size=(count, 2))
    if name == "dense":  # 10,000 a metre, and a room around them
        line = np.column_stack([np.linspace(0.0, 1e-4 * count, count), np.zeros(count)])
        return np.vstack([line, rng.uniform(-4.0, 4.0, (count // 4, 2))])
    if name == "one line":
        return np.column_stack([rng.uniform(-4.0, 4.0, count), np.full(count, 2.0)])
    return np.tile([0.3, -0.1], (count, 1))  # one spot


SCENES = ["walls", "scatter", "one far off", "a few at 80 m", "dense", "one line", "one spot"]


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("count", [3, 40, 500, 40_000])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_the_engine_finds_what_brute_force_finds(name, count, offset):
    """From 3 points to many, in any order, anywhere; grid and tree."""
    rng = np.random.default_rng(count)
    target = offset + rng.permutation(scene(name, rng, count))
    points = offset + np.vstack([scene(name, rng, 40), rng.normal(0.0, 30.0, (40, 2))])
    expected = nearest_by_brute_force(points, target)
    np.testing.assert_array_equal(nearest_rows(points, target), expected)


@given(st.one_of(lattice, clouds), st.one_of(lattice, clouds))
def test_the_engine_takes_the_first_of_equally_near_points(points, target):
    np.testing.assert_array_equal(
        nearest_rows(points, target), nearest_by_brute_force(points, target)
    )


@given(st.integers(0, 2**32 - 1))
def test_the_engines_tree_takes_the_first_of_ties_too(seed):
    """Thousands of points on few places: a grid would be crowded."""
    rng = np.random.default_rng(seed)
    target = rng.integers(-3, 4, (5000, 2)).astype(float)
    points = rng.integers(-8, 9, (50, 2)) / 2.0
    np.testing.assert_array_equal(
        nearest_rows(points, target), nearest_by_brute_force(points, target)
    )


# ---------------------------------------------------------------- many pairs


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_many_pairs_are_matched_as_each_alone(jobs, killian):
    """The same bytes for any number of threads, beams and bare points mixed."""
    chosen = [killian.scans[k] for k in range(0, 600, 4)]
    chosen[5] = Scan.from_points(chosen[5].points)
    pairs = np.array([(k + 1, k) for k in range(len(chosen) - 1)])
    guesses = np.tile(transform(1.0, 0.0, 0.0), (len(pairs), 1, 1))
    matches = match_pairs(chosen, pairs, guesses, ODOMETRY, jobs)
    for k, (newer, older) in enumerate(pairs):
        alone = icp(chosen[newer], chosen[older], guesses[k], ODOMETRY, engine="compiled")
        np.testing.assert_array_equal(matches.T_target_source[k], alone.poses[-1])
        assert matches.terminations[k] is alone.termination
        assert matches.iterations[k] == alone.iterations
        assert matches.inlier_counts[k] == alone.inlier_count
        numbers = matches.fitness[k], matches.inlier_rmse[k], matches.cost[k]
        np.testing.assert_array_equal(numbers, (alone.fitness, alone.inlier_rmse, alone.cost))
        if alone.observability is not None:
            np.testing.assert_allclose(
                matches.information[k], alone.observability.values, atol=1e-12
            )
            along = matches.directions[k].T @ alone.observability.vectors
            np.testing.assert_allclose(np.abs(np.diag(along)), 1.0, atol=1e-6)


def test_no_pairs_are_no_matches():
    none = match_pairs([], np.empty((0, 2), int), np.empty((0, 3, 3)), ODOMETRY)
    assert none.T_target_source.shape == (0, 3, 3)
    assert none.terminations == ()


# ---------------------------------------------------------------- who runs the loop


def python(code, **environment):
    """What a fresh interpreter prints, and what it says on standard error."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr.strip()


@pytest.mark.slow
def test_compiled_code_is_kept_where_the_package_is_read_only(tmp_path):
    """The second process finds it; one that can write nowhere compiles for itself, and says so.

    The smallest entry is compiled twice; buys that a laptop compiles once, and a course's server
    at all.
    """
    code = """if True:
        import numpy as np
        from labkit.engine import mean_values
        cell = np.zeros((1, 1, 2), dtype=np.intp)
        print(mean_values(np.ones((1, 1)), cell, cell[0]).item())
    """
    first = python(code, LABKIT_CACHE=str(tmp_path / "cache"))
    assert first == ("1.0", "compiling the ICP engine, this once: 10 to 30 s")
    assert python(code, LABKIT_CACHE=str(tmp_path / "cache")) == ("1.0", "")
    (tmp_path / "file").touch()
    out, said = python(code, LABKIT_CACHE=str(tmp_path / "file"))
    assert (out, said) == (
        "1.0",
        "compiling the ICP engine, in every process, for the cache cannot be written: 10 to 30 s",
    )


def test_a_cache_named_by_nothing_is_the_systems(monkeypatch):
    monkeypatch.setenv("LABKIT_CACHE", "elsewhere")
    assert user_cache() == Path("elsewhere")
    monkeypatch.delenv("LABKIT_CACHE")
    usual = user_cache()
    monkeypatch.setenv("LABKIT_CACHE", "")
    assert user_cache() == usual


@pytest.mark.parametrize("metric", ["point_to_point", "point_to_line"])
def test_no_layout_of_an_array_is_compiled_anew(metric):
    """Columns side by side, as of ``np.array([x, y]).T``, once cost another 17 s."""
    warm()
    entries = (loop.prepare, loop.prepare_with_normals, loop.prepare_and_run, loop.run)
    before = [len(entry.signatures) for entry in (*entries, loop.nearest_rows)]
    rows = scene("walls", np.random.default_rng(0), 90)
    columns = np.asfortranarray(rows)
    assert not columns.flags.c_contiguous
    target = Target(columns, np.asfortranarray(Target(rows).normals))
    guess = np.asfortranarray(transform(0.1, 0.0, 0.1))
    for reference in (columns, columns, target, target, Target(columns[::2])):
        icp(columns, reference, guess, IcpParameters(metric=metric), engine="compiled")
    nearest_rows(columns, columns[::2])
    scans = [Scan(points=columns), Scan(points=columns[::-1])]
    match_pairs(scans, np.array([[1, 0]]), guess[None], IcpParameters(metric=metric))
    assert [len(entry.signatures) for entry in (*entries, loop.nearest_rows)] == before


def test_importing_labkit_does_not_import_numba():
    out, _ = python("import sys, labkit, labkit.engine; print('numba' in sys.modules)")
    assert out == "False"


@pytest.mark.parametrize("engine", ["auto", "textbook", "compiled"])
def test_without_numba_the_textbook_runs(engine):
    code = f"""
import sys
sys.modules["numba"] = None
import labkit
try:
    result = labkit.icp([[0, 0], [1, 0], [0, 1]], [[0, 0], [1, 0], [0, 1]], engine="{engine}")
    print(result.termination.name)
except labkit.LabkitError as error:
    print(error)
"""
    out, _ = python(code)
    if engine == "compiled":
        assert out.startswith('`engine` "compiled" needs numba, which is not installed: pip')
    else:
        assert out == "CONVERGED_POSE"


def test_parameters_arrive_under_their_own_names():
    """They are handed over as bare numbers; the loop must read each from its own place."""
    other = IcpParameters(
        metric="point_to_line",
        approach=True,
        max_correspondence_distance=0.11,
        overlap_ratio=0.12,
        huber_delta=0.13,
        max_iterations=14,
        translation_tolerance=0.15,
        rotation_tolerance=0.16,
        cost_tolerance=0.17,
        step_fraction=0.18,
    )
    for parameters in (IcpParameters(), other):
        told = loop.told_by.py_func(matching.numbers_of(parameters))
        assert told.on_lines == (parameters.metric == "point_to_line")
        assert told.gate == parameters.max_correspondence_distance
        for name in set(told._fields) - {"on_lines", "gate"}:
            assert getattr(told, name) == getattr(parameters, name), name
