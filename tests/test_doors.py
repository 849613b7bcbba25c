"""Doors: every public function, with every kind of value in every place of its call."""

import inspect
import math
from functools import partial
from types import FunctionType

import numpy as np
import pytest

import labkit
from labkit import (
    IcpParameters,
    LabkitError,
    Scan,
    Target,
    apply,
    evaluation,
    filters,
    from_xytheta,
    icp,
    logs,
    odometry,
    plotting,
    simulation,
    transform,
)
from labkit.correspondences import distance_gate, huber_loss, huber_weights, overlap, pairs_at
from labkit.covariance import censi_covariance, censi_information, fuse, range_noise
from labkit.degeneracy import free_motions, observability, spread_ratio
from labkit.evaluation import ate, disagreement, forward_backward, rpe
from labkit.icp import minimise
from labkit.interactive.explorer.scenes import Scene
from labkit.line_alignment import align_to_lines, line_information
from labkit.neighbors import NearestNeighbors, nearest_by_brute_force
from labkit.normals import estimate_normals
from labkit.plotting import book_figure
from labkit.scan import scanner_poses
from labkit.se2 import relative, rotation
from labkit.simulation import Lidar, WheelNoise, room

T = transform(0.1, 0.05, 0.03)
POSE = np.array([0.1, 0.05, 0.03])
POSES = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.05], [0.2, 0.01, 0.1]])
LIDAR = Lidar(beam_count=61)
OLDER, NEWER = simulation.scan_along(room(), POSES[:2], LIDAR, rng=0)
POINTS = np.random.default_rng(0).uniform(-4.0, 4.0, (5, 2))
NORMALS = np.tile([0.0, 1.0], (5, 1))
TARGET = Target(OLDER)
RESULT = icp(NEWER, TARGET, metric="point_to_line")
PAIRS = RESULT.correspondences
RUN = odometry.estimate_odometry([OLDER, NEWER])
FIGURE = book_figure()
AX = FIGURE.subplots()
STAMPS = np.array([0.0, 1.0, 2.0])
DEGREES = np.array([[0.0, 0.0, 90.0], [1.0, 0.0, 180.0]])
FAILED = np.full((3, 3), math.nan)

EXAMPLES = {  # an argument for each place, by its name
    "T": T,
    "T_a_b": T,
    "T_init": POSE,
    "T_target_source": T,
    "T_w_a": T,
    "T_w_b": T,
    "T_world_scanner": T,
    "align": "rigid",
    "angle": 0.3,
    "angles": [0.0, 0.1],
    "ax": AX,
    "backward": POSES,
    "closing": POSE,
    "coarse": False,
    "count": 2,
    "covariance": np.eye(3),
    "delta": 1,
    "depth": 6.0,
    "distances": [0.1, 0.2, 0.4],
    "doorway": 1.2,
    "estimate": POSES,
    "figure": FIGURE,
    "forward": POSES,
    "grid": None,
    "height": 2.0,
    "huber_delta": 0.2,
    "increment": POSE,
    "increments": POSES,
    "information": RESULT.observability,
    "kept": [0, 2],
    "laser_offset": POSE,
    "lidar": LIDAR,
    "limits": odometry.SanityLimits(),
    "max_correspondence_distance": 0.5,
    "maximum": 5.0,
    "mean": POSE,
    "minimum": 0.1,
    "motion": [1.0, 0.0],
    "noise": WheelNoise(),
    "normals": NORMALS,
    "opening": 0.8,
    "other_normals": NORMALS,
    "overlap_ratio": 0.5,
    "pairs": PAIRS,
    "parameters": IcpParameters(),
    "period": 2.0,
    "points": POINTS,
    "points_b": POINTS,
    "pose": POSE,
    "poses": POSES,
    "prior": POSE,
    "prior_covariance": np.eye(3),
    "radius": 0.5,
    "range_max": 10.0,
    "range_min": 0.1,
    "range_std": 0.01,
    "ranges": [1.0, 2.0],
    "records": RUN.records,
    "reference": POSES,
    "residuals": [0.1, 0.2, 0.4],
    "result": RESULT,
    "rng": 0,
    "scan": NEWER,
    "scans": [OLDER, NEWER, NEWER],
    "share": 0.1,
    "size": 0.1,
    "source": POINTS,
    "source_normals": None,
    "speed": 1.0,
    "stamp": 0.0,
    "stamps": STAMPS,
    "start": POSE,
    "step_ax": AX,
    "step_fraction": 0.5,
    "stretch": 1.0,
    "target": POINTS + 0.1,
    "theta": 0.3,
    "times": STAMPS,
    "trajectories": {"odometry": POSES},
    "unit": "steps",
    "weights": np.ones(5),
    "wheels": POSES,
    "width": 5.0,
    "world": room(),
    "x": 1.0,
    "y": 2.0,
}
EXAMPLES_OF = {  # where a name has another meaning
    disagreement: {"prior": POSES},
    observability: {"target": TARGET},
    plotting.plot_correspondences: {"target": TARGET},
    plotting.plot_observability: {"target": TARGET},
    Target: {"scan": POINTS},
    plotting.plot_covariance: {"mean": [0.0, 1.0], "covariance": np.eye(2)},
    pairs_at: {"source": NEWER, "target": TARGET},
    odometry.estimate_odometry: {"priors": POSES, "parameters": None, "progress": iter},
}
FILES = {logs.read_log, logs.read_tum, logs.write_tum}  # tests/logs has doors for files
FUNCTIONS_OF_THE_CALLER = {"progress"}  # their own errors come through
VALUES = [
    *(
        np.zeros(shape)
        for shape in [(), (0,), (2,), (3,), (0, 2), (1, 2), (2, 5), (5, 3), (2, 2, 2)]
    ),
    *(np.full((5, 2), value) for value in (math.nan, math.inf, 1e200, 1j)),
    np.random.default_rng(1).uniform(-1.0, 1.0, (5, 2)).astype(str),
    np.ma.masked_less(POINTS, 0.0),
    *(-1, 0, 7, 10**400, -0.5, 0.5, 90.0, 1e-320, 1e300, math.nan, math.inf, -math.inf, True),
    *(np.uint8(3), np.float32(0.5), None, "text", b"bytes", [], {}, {"x": 1.0}, object(), Scan),
    *([[1.0, 2.0], [3.0]], iter([1.0]), lambda: None, np.random.default_rng(2)),
    *(FAILED, 2.0 * np.eye(3), np.eye(4), np.stack([T, T]), DEGREES),
    *(
        NEWER,
        Scan.from_points(POINTS),
        Scan.from_points([]),
        TARGET,
        RESULT,
        PAIRS,
        IcpParameters(),
    ),
    *(Lidar(beam_count=3), room(), RUN, RUN.records, AX, FIGURE, RESULT.observability),
]


def public_functions():
    """The functions of book/api.md: what labkit and its packages export, and what it names."""
    packages = (labkit, evaluation, logs, odometry, plotting, simulation)
    exported = {getattr(each, name) for each in packages for name in each.__all__}
    named = {
        *(distance_gate, overlap, huber_weights, huber_loss, pairs_at),
        *(
            censi_covariance,
            censi_information,
            fuse,
            range_noise,
            free_motions,
            observability,
            spread_ratio,
        ),
        *(minimise, align_to_lines, line_information, nearest_by_brute_force, NearestNeighbors),
        *(estimate_normals, scanner_poses, relative, rotation, Target),
        *(filters.range_band, filters.voxel_downsample, filters.remove_isolated),
        *(Scan.from_ranges, Scan.from_points, NearestNeighbors(POINTS).query, NEWER.select),
        RESULT.covariance,
    }
    functions = {each for each in exported if isinstance(each, FunctionType)}
    return sorted((functions | named) - FILES, key=lambda each: each.__qualname__)


def example_of(function):
    """Arguments for each place of a call, by name: of `EXAMPLES`, or its default."""
    examples = EXAMPLES | EXAMPLES_OF.get(function, {})
    places = inspect.signature(function).parameters.values()
    named = [each for each in places if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)]
    return {each.name: examples.get(each.name, each.default) for each in named}


@pytest.mark.parametrize("function", public_functions(), ids=lambda each: each.__qualname__)
def test_a_call_answers_or_raises_a_labkit_error(function):
    """The law: every public function × every place × every kind of value, without a warning."""
    AX.clear()
    example = example_of(function)
    function(**example)
    failures = []

    for name in example.keys() - FUNCTIONS_OF_THE_CALLER:
        for value in VALUES:
            try:
                function(**example | {name: value})
            except LabkitError:
                pass
            except Exception as error:
                failures.append(f"{name}={value!r:.60}: {type(error).__name__}: {error!s:.90}")

    assert not failures, "\n".join(failures)


@pytest.mark.parametrize("door", [ate, rpe, forward_backward, disagreement])
def test_rows_and_transforms_of_the_plane_and_of_space_are_the_same_poses(door):
    rows = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 3))
    plane = from_xytheta(rows)
    space = np.tile(np.eye(4), (5, 1, 1))
    space[np.ix_(range(5), [0, 1, 3], [0, 1, 3])] = plane
    expected = door(rows, 2.0 * rows)

    for given in (plane, space):
        errors = door(given, 2.0 * rows)
        np.testing.assert_allclose(
            errors.translation_errors, expected.translation_errors, atol=1e-12
        )


@pytest.mark.parametrize(
    ("call", "hint"),
    [
        (partial(transform, 1.0, 2.0, 90), r"radians within one turn, got 90: are these degrees\?"),
        (partial(from_xytheta, DEGREES), r"within one turn, got 180: are these degrees\?"),
        (
            partial(icp, POINTS, POINTS, [0.1, 0.0, 30.0]),
            r"`T_init` .* got 30: are these degrees\?",
        ),
        (
            partial(Scan.from_ranges, [1.0], [90.0]),
            r"90: are these degrees\? use `np\.radians` in P",
        ),
        (
            partial(scanner_poses, POSES, DEGREES[0]),
            r"`laser_offset` .* got 0 to 90: are these deg",
        ),
        (
            partial(odometry.estimate_odometry, [OLDER], POSES[:1], laser_offset=DEGREES[0]),
            r"`laser_offset` .* got 0 to 90: are these degrees\?",
        ),
        (
            partial(odometry.estimate_odometry, [OLDER, NEWER], [[0.1, 0.0, 30.0]]),
            r"`prior` .* got 30: are these degrees\?",
        ),
        (partial(odometry.MapOdometry, start=DEGREES[0]), r"`start` .* got 0 to 90: are these deg"),
        (partial(apply, T, POINTS.T), r"got \(2, 5\); transpose it \(`\.T`\)"),
        (partial(Scan.from_points, np.ones(541)), r"ranges go through `labkit\.Scan\.from_ranges"),
        (partial(apply, POSE, POINTS), r"poses .* go through `labkit\.from_xytheta`"),
        (partial(from_xytheta, T), "got transforms: .* `labkit.to_xytheta`"),
        (partial(icp, POINTS, POINTS, FAILED), r"NaN, .* failed; print `result\.message`"),
    ],
)
def test_a_slip_of_students_is_told_the_way_out(call, hint):
    """Degrees, a transposed table, ranges for points, a pose for a transform, a failed match."""
    with pytest.raises(LabkitError, match=hint):
        call()


CLASSES = (
    *(IcpParameters, Scan, Target, filters.Preprocessing, evaluation.PoseErrors),
    *(Lidar, WheelNoise, simulation.World, simulation.MovingObject),
    *(odometry.OdometryParameters, odometry.SanityLimits, Scene),
    *(odometry.MapOdometry, odometry.LessonOdometry),
)


@pytest.mark.parametrize(
    "call", [*public_functions(), *CLASSES], ids=lambda each: each.__qualname__
)
def test_a_keyword_that_does_not_exist_is_python_s_own_error(call):
    """The law: none is swallowed; a TypeError, or matplotlib's AttributeError, names it."""
    example = {} if call in CLASSES else example_of(call)

    with pytest.raises((TypeError, AttributeError), match=r"keyword .*'overlap_ration'"):
        call(**example, overlap_ration=0.5)


LOG = logs.Log(scans=(OLDER, NEWER), name="two", format="points")


@pytest.mark.parametrize(
    ("call", "place"),
    [
        (partial(logs.write_tum, None, STAMPS, POSES), "path"),
        *[(partial(LOG.head, count), "count") for count in ("2", 2.0, -1)],
        (partial(logs.read_log, "x.log", progress=None), "progress"),
        (partial(odometry.estimate_odometry, [OLDER], progress=None), "progress"),
        (partial(logs.read_log, "x.log", topic=POSE), "topic"),
        (partial(logs.read_log, "x.log", odometry_topic=POSE), "odometry_topic"),
        (partial(logs.read_log, "x.log", strict="no"), "strict"),
        (partial(RUN.count, POSE), r"decisions\[0\]"),
        (partial(RUN.count, "icp"), r"decisions\[0\]"),
        (partial(Scan, points=POINTS[:2], beams=[[1, 2], [3]]), "beams"),
    ],
)
def test_a_value_that_means_nothing_in_its_place_is_refused_by_the_place(call, place):
    with pytest.raises(LabkitError, match=rf"`{place}` must be "):
        call()


def test_a_length_of_any_number_type_is_that_length():
    world = simulation.two_rooms(width=np.uint8(3))
    np.testing.assert_array_equal(world.segments, simulation.two_rooms(width=3.0).segments)
