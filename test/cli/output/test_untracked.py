# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A recording of which nothing was tracked is named with the reason, any other is not."""

from types import SimpleNamespace

import pytest

from aick_ros.cli.output.untracked import say_if_untracked
from aick_ros.registration.status import Status

DARK = SimpleNamespace(status=Status.TOO_FEW_KEYPOINTS, reason='3 keypoints')


@pytest.mark.parametrize('records, sentence', [
    ([DARK, DARK], 'aick: no frame of desk was tracked: too few keypoints with depth: '
                   '3 keypoints\n'),
    ([DARK, SimpleNamespace(status=Status.FIRST_FRAME, reason='')], ''),
    ([], '')])
def test_only_where_nothing_was_tracked(capfd, records, sentence):
    assert say_if_untracked('desk', records) is bool(sentence)
    assert capfd.readouterr() == ('', sentence)
