# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The sentence says how many frames there are, which gaps have no pair, and what to do."""

import pytest

from aick_ros.cli.output.missing_pairs import without_pairs


@pytest.mark.parametrize('frames, gaps, remedy', [
    (8, [100], 'name gaps below 8, or read more frames'),
    (8, [8, 100], 'name gaps below 8, or read more frames'),
    (8, [7], 'name others; a pair counts where the ground truth covers both of its frames and '
             'none is missing between them'),
    (1, [1, 5], 'a pair requires two frames')])
def test_the_remedy_is_one_that_helps(frames, gaps, remedy):
    named = ','.join(str(gap) for gap in gaps)
    count = '1 frame' if frames == 1 else f'{frames} frames'
    assert without_pairs('desk', frames, gaps) == (
        f'desk ({count}) has no pair at --gaps {named}: {remedy}')
