# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is remembered of frames, against a list of those seen last."""

import copy
import pickle
import weakref

import numpy as np
import pytest

from aick_ros.registration.last_results import LastResults


class Frame:
    """Something that a result is made of."""


def test_the_results_of_the_frames_seen_last_are_remembered():
    frames, made, seen = [Frame() for _ in range(6)], [], []
    results = LastResults(lambda frame: made.append(frame) or object(), 3)
    known = {}
    for index in np.random.default_rng(1).integers(0, 6, 200):
        frame = frames[index]
        is_known = any(frame is one for one in seen[-3:])
        before = len(made)
        assert results.knows(frame) == is_known
        result = results(frame)
        assert len(made) == before + (not is_known)
        assert not is_known or result is known[index]
        known[index] = result
        seen = [one for one in seen if one is not frame] + [frame]


def test_a_result_that_is_none_is_remembered():
    made, frame = [], Frame()
    results = LastResults(made.append, 3)
    assert results(frame) is results(frame) is None
    assert made == [frame]


@pytest.mark.parametrize('gone', ['frame', 'results', 'count'])
def test_a_result_is_forgotten_with_its_frame(gone):
    """And with whoever remembers it, and where others have come since."""
    frame, results = Frame(), LastResults(lambda frame: Frame(), 2)
    known, other = weakref.ref(results(frame)), Frame()
    results(other)
    assert known() is results(frame)
    if gone == 'frame':
        del frame
    elif gone == 'results':
        del results
    else:
        later = [Frame() for _ in range(2)]
        list(map(results, later))
    assert known() is None


@pytest.mark.parametrize('copied', [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_copy_makes_the_same_and_remembers_nothing(copied):
    results, frame = LastResults(str, 2), Frame()
    before = results(frame)
    other = copied(results)
    assert isinstance(other, LastResults)
    assert other(frame) == before and other(frame) is not before
