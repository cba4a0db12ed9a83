# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is remembered of frames, against a list of those seen last."""

import pickle

import numpy as np

from aick_ros.registration.last_results import LastResults


class Frame:
    """Equal to any other, as frames of the same images are."""

    def __eq__(self, other):
        return True

    def __hash__(self):
        return 0


def test_the_results_of_the_frames_seen_last_are_remembered():
    frames, made, seen = [Frame() for _ in range(6)], [], []
    results = LastResults(lambda frame: made.append(frame) or object(), 3)
    known = {}
    for index in np.random.default_rng(1).integers(0, 6, 200):
        frame = frames[index]
        is_known = any(frame is one for one in seen[-3:])
        before = len(made)
        result = results(frame)
        assert len(made) == before + (not is_known)
        assert not is_known or result is known[index]
        known[index] = result
        seen = [one for one in seen if one is not frame] + [frame]


def test_it_can_be_pickled():
    results = LastResults(id, 2)
    assert isinstance(pickle.loads(pickle.dumps(results)), LastResults)
