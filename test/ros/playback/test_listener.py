# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How long answers are awaited, by answers that come one by one."""

import itertools
from types import SimpleNamespace

import pytest

from aick_ros.ros.playback import listener
from aick_ros.ros.playback.listener import Listener


@pytest.fixture
def answer(monkeypatch):
    """Return a function that answers stamps one by one, and returns those that were awaited."""
    def run(coming, stamps):
        heard = SimpleNamespace(answers=[])
        rest = iter(coming)

        def wait_until(condition, timeout):
            heard.answers += [SimpleNamespace(stamp=stamp) for stamp in itertools.islice(rest, 1)]
            return condition()

        monkeypatch.setattr(listener, 'wait_until', wait_until)
        Listener.wait_for_answers(heard, stamps)
        return [answer.stamp for answer in heard.answers]
    return run


@pytest.mark.parametrize('coming, awaited', [
    ([10, 20, 30, 40], [10, 20, 30]), ([30, 40], [30]), ([10, 30, 40], [10, 30]),
    ([10, 20], [10, 20]), ([20, 10, 15, 40], [20, 10, 15]), ([], [])])
def test_until_all_are_answered_or_the_last_is_or_no_more_come(answer, coming, awaited):
    assert answer(coming, [10, 20, 30]) == awaited


def test_no_image_has_no_answer(answer):
    assert answer([10], []) == []
