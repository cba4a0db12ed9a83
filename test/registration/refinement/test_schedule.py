# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The order of tracking, steps and corrections, by a tracker and a problem of known answers."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.refinement.moving_objects import LEAST_SHARE
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

FIRST = se3.exp([0.1, 0.2, 0.3, 0.1, -0.2, 0.1])
STEP = np.array([0.01, -0.02, 0.03, 0.02, 0.01, -0.01])
ITERATIONS = 6
FOCAL_LENGTH, DEPTH = 500.0, 2.0  # px and m


class PlayedTracks:
    """
    As many tracks as are told, on the axis of the target by the first pose.

    :ivar points: in the source, Nx3 [m].
    """

    def __init__(self, count):
        self.points = np.tile(se3.transform(se3.inverse(FIRST), np.array([[0.0, 0.0, DEPTH]])),
                              (count, 1))

    def __len__(self):
        return len(self.points)


class Frame(SimpleNamespace):
    """A frame that equals itself alone."""

    __hash__ = object.__hash__


class Played:
    """
    A refinement whose steps are told, with notes of all that its parts are given.

    :param counts: numbers of tracks each time the tracker is asked.
    :param tracked: numbers of tracks that confirm each solution.
    :param steps: of the pose; the last one is that of all after it.
    :param last: motion of the target, 4x4, after which it has the pose of a solution.
    """

    def __init__(self, monkeypatch, counts=(60,), tracked=(60,), steps=(STEP,), most=100,
                 last=FIRST, window=9):
        self.log, self._counts, self._tracked = [], list(counts), list(tracked)
        self._steps, self._most, self._last = steps, most, last
        self.objects = []  # whether others are left out each time, until none are
        self.shares = []  # the least one of the tracks, each time
        module = 'aick_ros.registration.refinement.refinement'
        monkeypatch.setattr(f'{module}.Tracker', self._make_tracker)
        monkeypatch.setattr(f'{module}.Problem', self._make_problem)
        monkeypatch.setattr(f'{module}.Approach', lambda *made_with: SimpleNamespace(
            nearer=lambda *of: self.log.append(('nearer', *of)) or self.nearer))
        self.settings = with_values(Settings(), {
            'refinement.iterations': ITERATIONS, 'refinement.max_tracks': most,
            'refinement.track_window': window})
        self.noise = MeasuredNoise()
        self.misalignment = MisalignmentEstimate(Misalignment(np.zeros(6), 0.01, 0.0, 0.0))
        self.refinement = Refinement(self.settings.refinement, self.settings.sensor, self.noise,
                                     self.misalignment)
        self.source, self.target = (Frame(
            stamp=round(10 * twist), keypoints=range(80), twist=np.full(6, twist),
            frame=SimpleNamespace(camera=SimpleNamespace(fx=FOCAL_LENGTH)))
            for twist in (0.1, 0.2))

    def _make_tracker(self, *made_with):
        self.log.append(('tracker', *made_with))
        return SimpleNamespace(track=lambda *of: self._track('track', *of),
                               track_back=lambda *of, is_near: self._track(
                                   'track_back', *of, is_near))

    def _track(self, *of):
        self.log.append(of)
        return PlayedTracks(self._counts.pop(0))

    def _make_problem(self, *made_with):
        self.log.append(('problem', *made_with))
        self._number = -1
        return SimpleNamespace(
            step=self._step, finish=self._finish,
            begin_without=lambda *of: self.log.append(('begin without', *of)),
            leave_out_objects=lambda pose, share: (
                self.shares.append(share) or bool(self.objects) and self.objects.pop(0)),
            correct=lambda *by: self.log.append(('correct', *by)))

    def _step(self, pose, coarse):
        self._number += 1
        self.log.append(('step', pose, coarse))
        step = self._steps[min(self._number, len(self._steps) - 1)]
        return se3.perturbed(pose, step), step

    def _finish(self, pose):
        self.log.append(('finish', pose))
        return SimpleNamespace(T_target_source=self._last @ pose,
                               tracked=range(self._tracked.pop(0)))

    def asked(self, kind):
        return [entry[1:] for entry in self.log if entry[0] == kind]

    def kinds(self):
        return [entry[0] for entry in self.log if entry[0] != 'tracker']


@pytest.fixture
def play(monkeypatch):
    return lambda **values: Played(monkeypatch, **values)


def after(steps):
    """Return the first pose after some steps."""
    pose = FIRST
    for step in steps:
        pose = se3.perturbed(pose, step)
    return pose


def test_a_pose_takes_a_coarse_step_and_then_fine_ones_and_the_last_ends_it(play):
    played = play()
    found = played.refinement.refine(played.source, played.target, FIRST)
    assert played.kinds() == [
        'track', 'problem', 'correct', 'begin without', *(ITERATIONS - 1) * ['step'], 'finish']
    assert [coarse for _, coarse in played.asked('step')] == [True, *(ITERATIONS - 2) * [False]]
    for number, (pose, _) in enumerate(played.asked('step')):
        np.testing.assert_allclose(pose, after(number * [STEP]), atol=1e-12)
    (pose,), = played.asked('finish')
    np.testing.assert_allclose(pose, after((ITERATIONS - 1) * [STEP]), atol=1e-12)
    np.testing.assert_allclose(found.T_target_source, FIRST @ pose, atol=1e-12)


def test_its_parts_get_the_frames_and_what_is_known_of_the_camera(play):
    played = play()
    played.refinement.refine(played.source, played.target, FIRST)
    settings, sensor = played.settings.refinement, played.settings.sensor
    assert played.asked('tracker') == [(settings, sensor)]
    assert played.asked('track') == [(played.source, played.target, FIRST)]
    (source, target, tracks, *others), = played.asked('problem')
    assert source is played.source and target is played.target and len(tracks) == 60
    assert others == [settings, sensor, played.noise]
    (misalignment, twist, pose), = played.asked('correct')
    assert misalignment is played.misalignment.misalignment
    assert twist is played.source.twist and pose is FIRST


def test_the_velocity_is_that_to_the_pose_once_it_is_roughly_known(play):
    played = play()
    predicted = SimpleNamespace(twist_with=lambda pose: ('twist with', pose))
    played.refinement.refine(played.source, played.target, FIRST, predicted)
    assert played.kinds()[:7] == ['track', 'problem', 'correct', 'begin without', 'step', 'step',
                                  'correct']
    _, (misalignment, (_, of), pose) = played.asked('correct')
    assert misalignment is played.misalignment.misalignment and of is pose
    np.testing.assert_allclose(pose, after(2 * [STEP]), atol=1e-12)


@pytest.mark.parametrize('small, steps', [
    ([STEP, STEP, 0 * STEP], 3), ([STEP, 0 * STEP], 3), ([0 * STEP, STEP], ITERATIONS - 1),
    ([STEP, STEP, np.full(6, -1.9e-5)], 3), ([STEP, STEP, np.full(6, -2.1e-5)], ITERATIONS - 1)])
def test_a_fine_step_that_is_small_is_the_last_one(play, small, steps):
    """The first two are in any case taken: before them the correction is not known."""
    played = play(steps=small)
    played.refinement.refine(played.source, played.target, FIRST)
    assert played.kinds().count('step') == steps
    (pose,), = played.asked('finish')
    taken = [small[min(number, len(small) - 1)] for number in range(steps)]
    np.testing.assert_allclose(pose, after(taken), atol=1e-12)


@pytest.mark.parametrize('most, fewest', [(100, 40), (60, 30)])
@pytest.mark.parametrize('found, is_enough', [(7, True), (6, False)])
def test_keypoints_are_tracked_again_where_few_agree_and_enough_to_improve_were_found(
        play, most, fewest, found, is_enough):
    """Few are less than half of those that are sought."""
    for tracked in (fewest, fewest - 1):
        played = play(counts=(found, 50), tracked=(tracked, 55), most=most)
        refined = played.refinement.refine(played.source, played.target, FIRST, None)
        is_again = is_enough and tracked < fewest
        assert played.kinds().count('track') == 1 + is_again
        assert len(refined.tracked) == (55 if is_again else tracked)


@pytest.mark.parametrize('window', [9, 21])
@pytest.mark.parametrize('share, is_again', [(0.19, False), (0.21, True)])
def test_few_are_not_tracked_again_from_a_pose_that_is_about_the_same(
        play, window, share, is_again):
    """By the displacement of the keypoints, in windows."""
    shift = share * window * DEPTH / FOCAL_LENGTH
    played = play(counts=(10, 10), tracked=(5, 6), steps=[0 * STEP],
                  last=se3.exp([0.6 * shift, 0.8 * shift, 0, 0, 0, 0]), window=window)
    found = played.refinement.refine(played.source, played.target, FIRST)
    assert len(played.asked('track')) == len(played.asked('problem')) == 1 + is_again
    assert len(found.tracked) == 5 + is_again


def test_tracked_again_all_begins_at_the_better_pose(play):
    played = play(counts=(10, 50), tracked=(5, 55))
    predicted = SimpleNamespace(twist_with=lambda pose: 'a twist')
    played.refinement.refine(played.source, played.target, FIRST, predicted)
    better = FIRST @ played.asked('finish')[0][0]
    source, target, pose = played.asked('track')[1]
    assert source is played.source and target is played.target
    np.testing.assert_array_equal(pose, better)
    assert len(played.asked('problem')[1][2]) == 50
    np.testing.assert_array_equal(played.asked('correct')[2][2], better)
    np.testing.assert_array_equal(played.asked('step')[ITERATIONS - 1][0], better)
    assert played.asked('correct')[3][1] == 'a twist'


@pytest.mark.parametrize('nearer', [None, np.diag([-1.0, -1.0, 1.0, 1.0])])
def test_without_keypoints_of_the_source_those_of_the_target_are_tracked_once(play, nearer):
    """From a pose that a few of them show to be near, or from the first one."""
    played = play(counts=(10,), tracked=(3,))
    played.nearer = nearer
    predicted = SimpleNamespace(twist_with=lambda pose: 'a twist')
    found = played.refinement.refine_back(played.source, played.target, FIRST, predicted)
    begin = FIRST if nearer is None else nearer
    assert played.asked('nearer') == [(played.source, played.target, FIRST)]
    (source, target, pose, is_near), = played.asked('track_back')
    assert (source, target, is_near) == (played.source, played.target, nearer is not None)
    assert pose is begin
    assert played.asked('track') == [] and len(played.asked('problem')) == 1
    assert len(played.asked('problem')[0][2]) == 10
    assert played.asked('correct')[0][2] is begin and played.asked('correct')[1][1] == 'a twist'
    assert len(found.tracked) == 3


@pytest.mark.parametrize('objects, rounds', [([], 0), ([True], 1), ([True, True, True, True], 3)])
def test_steps_are_made_again_each_time_other_objects_are_left_out(monkeypatch, objects, rounds):
    """Until the step is small, three times at most."""
    small = np.full(6, 1e-6)
    played = Played(monkeypatch, steps=[STEP, STEP, STEP, small])
    played.objects = list(objects)
    played.refinement.refine(played.source, played.target, FIRST)
    steps = played.asked('step')
    assert len(steps) == 4 + rounds
    assert [coarse for _, coarse in steps] == [True] + (3 + rounds) * [False]
    (finished,), = played.asked('finish')
    np.testing.assert_allclose(finished, se3.perturbed(steps[-1][0], small), atol=1e-12)


def test_what_moves_is_left_out_from_the_first_pose_on(monkeypatch):
    """What is known of the target, and the depth near tracks that the caller has."""
    played = Played(monkeypatch)
    moving = PlayedTracks(3)
    played.refinement._known_objects = SimpleNamespace(of={2: 'known'}.get)
    played.refinement.refine(played.source, played.target, FIRST, moving=moving)
    (known, left_out, pose), = played.asked('begin without')
    assert known == 'known' and left_out is moving and pose is FIRST
    kinds = played.kinds()
    assert kinds.index('correct') < kinds.index('begin without') < kinds.index('step')


def test_small_objects_are_sought_where_the_caller_asks_for_them(monkeypatch):
    """Of a twentieth of the tracks; otherwise of a fifth."""
    played = Played(monkeypatch, counts=(60, 60), tracked=(60, 60))
    played.refinement.refine(played.source, played.target, FIRST)
    assert set(played.shares) == {LEAST_SHARE}
    played.shares.clear()
    played.refinement.without_small_objects(played.source, played.target, FIRST)
    assert set(played.shares) == {0.05}
