# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Less is computed after two seconds of overload, and everything again once there is time."""

import pytest

from aick_ros.ros.load_shedding import Load, LoadShedding, Step
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import values, with_values
from aick_ros.settings.presets import PRESETS

ORDER = list(Step)


class Second:
    """Lets seconds pass with a load."""

    def __init__(self):
        self.shedding, self.at, self.arrived, self.dropped, self.busy = (
            LoadShedding(), 100.0, 0, 0, [5.0, 7.0])
        self.changes = []
        self.update()

    def update(self):
        self.changes.append(self.shedding.update(
            Load(self.at, self.arrived, self.dropped, tuple(self.busy))))

    def pass_by(self, busy, dropped, count=1):
        """Let seconds with 30 frames pass; return the step then."""
        for _ in range(count):
            self.at += 1.0
            self.arrived += 30
            self.dropped += dropped
            self.busy[0] += 0.1
            self.busy[1] += busy
            self.update()
        return self.shedding.step


def over(second, steps):
    """Overload it until so many steps are taken."""
    return second.pass_by(1.0, 10, 2 * steps)


def test_each_two_seconds_of_overload_are_a_step():
    second = Second()
    assert second.pass_by(0.95, 10) is Step.ALL
    for step in (*ORDER[1:], ORDER[-1]):
        assert second.pass_by(0.95, 10, 1) is step
        assert second.pass_by(0.95, 10, 1) is step
    assert second.changes.count(True) == 3


def test_a_second_without_overload_begins_the_time_anew():
    second = Second()
    for _ in range(4):
        second.pass_by(0.95, 10)
        assert second.pass_by(0.95, 0) is Step.ALL


@pytest.mark.parametrize('busy, dropped', [
    (0.5, 10),  # dropped though the threads wait, as for a transform
    (1.0, 0),   # all time is used, and it suffices
    (1.0, 1),   # a frame now and then
])
def test_what_is_no_overload_changes_nothing(busy, dropped):
    assert Second().pass_by(busy, dropped, 10) is Step.ALL


def test_with_time_to_spare_it_comes_back_step_by_step():
    second = Second()
    assert over(second, 3) is Step.FEWER_FRAMES
    for step in reversed(ORDER[:-1]):
        assert second.pass_by(0.3, 0, 4) is not step
        assert second.pass_by(0.3, 0, 1) is step
    assert second.pass_by(0.3, 0, 20) is Step.ALL


def test_where_the_work_left_out_would_not_fit_it_does_not_come_back():
    second = Second()
    over(second, 1)
    assert second.pass_by(0.6, 0, 30) is Step.FEWER_KEYPOINTS
    assert second.pass_by(0.3, 1, 30) is Step.FEWER_KEYPOINTS  # frames are still dropped


def test_frames_dropped_while_transforms_are_late_keep_no_step():
    """One thread works for a tenth of the time and waits for the rest: frames are dropped."""
    shedding = LoadShedding()
    shedding.step = Step.FEWER_KEYPOINTS
    for second in range(6):
        shedding.update(Load(100.0 + second, 30 * second, 20 * second,
                             (0.02 * second, 0.1 * second), waited=0.8 * second))
    assert shedding.step is Step.ALL
    for second in range(6, 20):
        assert not shedding.update(Load(100.0 + second, 30 * second, 20 * second,
                                        (0.02 * second, 0.1 * second), waited=0.8 * second))


def test_a_restart_of_the_count_is_no_overload():
    second = Second()
    second.pass_by(1.0, 10)
    second.dropped = 0
    assert second.pass_by(1.0, 0) is Step.ALL


def test_each_step_includes_those_before():
    second = Second()
    seen, changed = [], []
    for _ in ORDER:
        seen.append([second.shedding.admits(number) for number in range(4)])
        settings = values(second.shedding.settings(Settings()))
        changed.append({name: (value, settings[name]) for name, value in values(Settings()).items()
                        if settings[name] != value})
        over(second, 1)
    keypoints = {'features.max_keypoints': (400, 200), 'features.orb.nfeatures': (1100, 550),
                 'features.sift.nfeatures': (1100, 550), 'refinement.max_tracks': (400, 200)}
    points = {'refinement.surface_points': (2000, 1000)}
    assert changed == [{}, keypoints, {**keypoints, **points}, {**keypoints, **points}]
    assert seen == [[True] * 4] * 3 + [[True, False, True, False]]


def test_few_stay_few_and_all_stay_all():
    second = Second()
    over(second, 1)
    settings = second.shedding.settings(with_values(Settings(), {
        'features.max_keypoints': 0, 'features.orb.nfeatures': 120, 'refinement.max_tracks': 80}))
    assert settings.features.max_keypoints == 0
    assert (settings.features.orb.nfeatures, settings.refinement.max_tracks) == (100, 80)


def test_it_says_what_is_left_out():
    second = Second()
    assert second.shedding.sentence == ''
    over(second, 2)
    assert second.shedding.sentence == (
        'frames come faster than they can be registered: half of the keypoints and of the surface '
        'points are dropped; limit the rate with max_update_rate, set preset to embedded, or '
        'shed_load to false')
    # so the remedies must exist, and each step names what it reduces
    assert 'embedded' in PRESETS
    assert {'max_update_rate', 'shed_load'} <= values(NodeSettings()).keys()
    words = [step.value for step in Step]
    assert words[0] == 'nothing'
    assert ['keypoints' in word for word in words] == [False, True, True, True]
    assert ['surface points' in word for word in words] == [False, False, True, True]
    assert ['frames' in word for word in words] == [False, False, False, True]


def step_after(seconds, busy, dropped, arrived, step=Step.ALL):
    """Return the step after some seconds with the same load, in units exact in binary."""
    shedding = LoadShedding()
    shedding.step = step
    for second in range(seconds + 1):
        shedding.update(Load(8.0 * second, arrived * second, dropped * second,
                             (0.0, 8.0 * busy * second)))
    return shedding.step


@pytest.mark.parametrize('busy, dropped, is_over', [
    (0.8125, 6, True), (0.8125, 5, False), (0.8, 6, False), (0.75, 50, False)])
def test_overload_is_more_than_a_twentieth_dropped_at_more_than_four_fifths(
        busy, dropped, is_over):
    assert step_after(2, busy, dropped, 100) is (Step.FEWER_KEYPOINTS if is_over else Step.ALL)


@pytest.mark.parametrize('busy, dropped, is_at_ease', [
    (0.375, 0, True), (0.4, 0, False), (0.4375, 0, False), (0.375, 1, False)])
def test_ease_is_less_than_two_fifths_and_nothing_dropped(busy, dropped, is_at_ease):
    found = step_after(5, busy, dropped, 100, Step.FEWER_POINTS)
    assert found is (Step.FEWER_KEYPOINTS if is_at_ease else Step.FEWER_POINTS)


def test_no_time_is_no_load():
    """As where a clock stands still: whatever was done, no share of it is known."""
    shedding = LoadShedding()
    for number in range(10):
        assert not shedding.update(Load(3.0, 100 * number, 50 * number, (9.0 * number,)))
    assert shedding.step is Step.ALL


@pytest.mark.parametrize('given, left', [(400, 200), (201, 100), (200, 100), (199, 100),
                                         (100, 100), (99, 99), (0, 0)])
def test_half_is_left_but_not_less_than_a_hundred_keypoints(given, left):
    shedding = LoadShedding()
    shedding.step = Step.FEWER_KEYPOINTS
    core = with_values(Settings(), {'features.max_keypoints': given})
    assert shedding.settings(core).features.max_keypoints == left
