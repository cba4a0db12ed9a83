# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A sensor that contradicts another one: suspected, then wrong, then right again."""

import numpy as np

from aick_ros.odometry.inertial.disagreement import Disagreement


def test_it_is_suspected_before_it_is_wrong_and_until_it_is_right():
    found, states = Disagreement(10.0, 0.3, 0.15), []
    for agrees in (True, False, False, False, False, *[True] * 7):
        found.note(agrees)
        states.append((found.is_suspected, found.is_wrong))
    # shares of 0, 0.1, 0.19, 0.27, 0.34, then nine tenths of the one before
    assert states[:5] == [(False, False), (False, False), (True, False), (True, False),
                          (True, True)]
    assert states[5:] == [(True, True)] * 7
    found.note(True)
    assert not found.is_suspected and not found.is_wrong


def test_it_is_suspected_in_proportion_between_the_two_shares():
    disagreement = Disagreement(memory=10.0, wrong=0.5, right=0.1)
    shares, found = [], []
    share = 0.0
    for _ in range(8):
        share += (1.0 - share) / 10.0
        disagreement.note(False)
        shares.append(share)
        found.append(disagreement.suspicion)
    expected = [(share - 0.1) / 0.4 if share <= 0.5 else 1.0 for share in shares]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert found[0] == 0.0 and not any(np.diff(found) < 0.0) and found[-1] == 1.0
    disagreement.note(True)  # the share is below, but it is still wrong
    assert disagreement.is_wrong and disagreement.suspicion == 1.0
