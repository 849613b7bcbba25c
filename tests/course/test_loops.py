"""Killian Court with its loops."""

import numpy as np
import pytest

import labkit
from labkit.course.loops import listed_pairs, match_loop

pytest.importorskip("rtbdata")


def test_a_listed_pair_is_two_scans_apart_in_time_and_near_in_space():
    pairs, guesses = listed_pairs()

    assert pairs.shape == (1115, 2)
    assert (pairs[:, 1] > pairs[:, 0] + 1).all()
    assert np.median(np.hypot(*guesses[:, :2].T)) < 5.0  # m


def test_a_match_of_two_scans_of_one_place_passes_and_lies_near_its_guess():
    log = labkit.read_log("killian")
    pairs, guesses = listed_pairs()

    motion, passed = match_loop(log, *pairs[0], labkit.from_xytheta(guesses[0]))

    assert passed
    np.testing.assert_allclose(motion, guesses[0], atol=0.5)


@pytest.mark.parametrize("places", [(100, 3000), (500, 2500)])
def test_a_match_of_two_places_does_not_pass(places):
    log = labkit.read_log("killian")

    _, passed = match_loop(log, *places, labkit.transform(0.0, 0.0, 0.0))

    assert not passed
