# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Choice of the frame pairs of a recording."""


def test_a_limited_number_of_pairs_is_evenly_spaced(recording):
    pairs = recording.pairs((1, 3), most=3)
    assert [pair.target for pair in pairs if pair.gap == 1] == [0, 3, 6]
    assert [pair.target for pair in pairs if pair.gap == 3] == [0, 2, 4]
