# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which frame becomes the next keyframe, by a policy whose answers are known."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import keyframe_choice
from aick_ros.odometry.keyframe_choice import KeyframeChoice
from aick_ros.odometry.reference import Loss, Reference, References
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values


@dataclass(frozen=True, eq=False)
class View:
    stamp: int
    sharpness: int = 1
    repeat: Repeat = Repeat.NONE
    keypoints: str = 'own'
    is_tracked: bool = False
    is_bare: bool = False
    as_seen_by: int | None = None
    twist: str | None = 'its own'
    twist_variances: str | None = 'known'

    def is_blurred_beside(self, other):
        return self.sharpness < other.sharpness

    def bare(self):
        return replace(self, is_bare=True)

    def moving(self, twist, variances):
        return replace(self, twist=twist, twist_variances=variances)


@pytest.fixture(autouse=True)
def nothing_moves_in(monkeypatch):
    for name in ('on_intruders', 'hidden_by_intruders'):
        monkeypatch.setattr(keyframe_choice, name, lambda *_: np.zeros(4, bool))


SEEN = SimpleNamespace(  # by the images alone
    T_target_source='a pose', fit=None, is_by_colour=False)


def pose_at(number):
    return PoseWithCovariance(se3.exp([number, 0, 0, 0, 0, 0]), (1 + number) * np.eye(6))


class Policy:
    """Answers as it is told, None for what objects decide, and records what it is asked."""

    def __init__(self, keeps):
        self._keeps, self.begun, self.counts, self.asked = keeps, 0, [], []
        self.detected, self.lost = [], []

    def begin(self):
        self.begun += 1

    def keeps(self, prepared, registration, count, lost):
        self.counts.append(count)
        self.lost.append(lost)
        return self._keeps or self._keeps is None and lost > 0

    def advance(self, prepared, registration, count, lost):
        self.asked.append((prepared, registration))
        return self.keeps(prepared, registration, count, lost)

    def keeps_depth_reference(self, shape, seen):
        self.asked.append((shape, seen))
        return self._keeps


def alike(target, source):
    """Return a keyframe prepared as a frame is: with four keypoints."""
    return replace(target, as_seen_by=source.stamp, keypoints='four')


def advance(keeps, is_by_depth=False, to_keyframe=True, loss=None, seen=SEEN, **changes):
    """Return the references after a frame, the keyframe, the frame and the policy."""
    first, middle = (Reference(View(stamp, keypoints='of other settings'), pose_at(stamp),
                               pose_at(9), loss=loss) for stamp in (0, 1))
    references, policy = References(first), Policy(keeps)
    references.track(middle, first)
    references.loss = loss
    last = Reference(View(2, **changes), pose_at(2), pose_at(8))
    choice = KeyframeChoice(Settings(), SimpleNamespace(
        prepared_like=alike,
        with_own_keypoints=lambda prepared: policy.detected.append(prepared) or replace(
            prepared, keypoints='own', is_tracked=False)))
    choice._policy = policy
    choice.advance(references, last, SimpleNamespace(
        reference=references.keyframe if to_keyframe else middle, seen=seen,
        registration=SimpleNamespace(is_by_depth=is_by_depth)))
    return references, first, last, policy


@pytest.mark.parametrize('keeps, changes, is_kept', [
    (True, {}, True), (False, {}, False), (False, {'sharpness': 0}, True),
    (False, {'repeat': Repeat.COLOUR}, True), (False, {'repeat': Repeat.DEPTH}, True)])
def test_a_frame_becomes_the_keyframe_unless_it_is_blurred_or_repeats(keeps, changes, is_kept):
    references, first, last, policy = advance(keeps, **changes)
    assert references.keyframe.stamp == (first.stamp if is_kept else last.stamp)
    assert references.last.stamp == last.stamp
    assert policy.begun == (0 if is_kept else 1)  # by what is known of the next keyframe: nothing


def test_a_frame_by_colour_alone_becomes_no_keyframe():
    """Its depth is missing; the policy is not asked."""
    seen = SimpleNamespace(**vars(SEEN) | {'is_by_colour': True})
    references, first, last, policy = advance(False, seen=seen)
    assert (references.keyframe.stamp, references.last.stamp) == (first.stamp, last.stamp)
    assert not policy.asked and not policy.begun


@pytest.mark.parametrize('to_keyframe', [True, False])
def test_the_frame_that_serves_on_is_as_the_last_one_saw_it(to_keyframe):
    """It is brought to the same distortion once, not with each frame."""
    references, _, last, _ = advance(True, to_keyframe=to_keyframe)
    assert references.keyframe.prepared.as_seen_by == last.stamp
    assert references.sharp is references.keyframe


@pytest.mark.parametrize('twist, variances, expected', [
    (None, None, ('of the next', 'of the next')), ('its own', None, ('its own', 'of the next')),
    ('its own', 'its own', ('its own', 'its own'))])
def test_a_first_keyframe_has_the_velocity_of_the_frame_after_it(twist, variances, expected):
    """Its errors may be known later still."""
    first = Reference(View(0, twist=twist, twist_variances=variances), pose_at(0))
    references = References(first)
    choice = KeyframeChoice(Settings(), SimpleNamespace(
        prepared_like=lambda target, source: target))
    choice._policy = Policy(True)
    last = Reference(View(1, twist='of the next', twist_variances='of the next'), pose_at(1),
                     pose_at(8))
    choice.advance(references, last, SimpleNamespace(
        reference=references.keyframe, seen=SEEN,
        registration=SimpleNamespace(is_by_depth=False)))
    keyframe = references.keyframe.prepared
    assert (keyframe.twist, keyframe.twist_variances) == expected


@pytest.mark.parametrize('is_tracked, kind', [
    (False, 'on_intruders'), (True, 'hidden_by_intruders')])
@pytest.mark.parametrize('moved_in, moving, lost', [
    (3, None, 3), (0, 2, 2), (1, 2, 2), (0, None, 0)])
def test_what_objects_hide_or_carry_is_not_asked_of_another_keyframe(
        monkeypatch, is_tracked, kind, moved_in, moving, lost):
    """Those that have moved in are sought only where the keyframe would be replaced."""
    given = []
    monkeypatch.setattr(keyframe_choice, kind,
                        lambda *of: given.append(of) or np.arange(4) < moved_in)
    choice = KeyframeChoice(Settings(), SimpleNamespace(prepared_like=alike))
    view, fit = View(2, is_tracked=is_tracked), None if moving is None else SimpleNamespace(
        objects=SimpleNamespace(count=moving))
    attempt = SimpleNamespace(reference=Reference(View(0), pose_at(0)),
                              seen=SimpleNamespace(T_target_source='a pose', fit=fit,
                                                   is_by_colour=False))
    choice._policy = policy = Policy(None)
    assert choice.replaces(view, attempt) is (lost == 0)
    assert policy.lost == ([0, lost] if lost else [0])
    (frame, keyframe, pose, sensor), = given
    assert frame is view and keyframe.as_seen_by == 2 and pose == 'a pose'
    assert sensor is choice._sensor
    choice._policy = Policy(True)
    assert not choice.replaces(view, attempt) and len(given) == 1


@pytest.mark.parametrize('keeps, changes, replaces', [
    (True, {}, False), (False, {}, True), (False, {'sharpness': 0}, False),
    (False, {'repeat': Repeat.COLOUR}, False)])
def test_the_next_keyframe_is_known_before_it_is_made(keeps, changes, replaces):
    choice = KeyframeChoice(Settings(), SimpleNamespace(prepared_like=alike))
    choice._policy = policy = Policy(keeps)
    found = choice.replaces(View(2, is_tracked=True, **changes), SimpleNamespace(
        reference=Reference(View(0), pose_at(0)), seen=SEEN))
    assert found is replaces
    assert policy.counts == ([] if 'repeat' in changes else [4])  # as the frame is prepared
    assert policy.begun == 0 and policy.asked == []


def test_registered_to_another_frame_the_policy_begins_with_that():
    references, _, _, policy = advance(True, to_keyframe=False)
    assert policy.begun == 1
    assert references.keyframe.stamp == 1


@pytest.mark.parametrize('is_tracked, count', [(False, 3), (True, 4)])
def test_of_tracked_keypoints_the_share_is_of_those_of_the_keyframe(is_tracked, count):
    """By the settings of now."""
    references, _, _, policy = advance(False, is_tracked=is_tracked)
    assert policy.counts == [count]
    assert len(policy.detected) == is_tracked
    assert not references.keyframe.prepared.is_tracked  # it has keypoints of its own
    assert references.keyframe.prepared.keypoints == 'own'


@pytest.mark.parametrize('keeps', [True, False])
def test_by_depth_the_keyframe_of_keypoints_stays(keeps):
    references, first, last, policy = advance(keeps, is_by_depth=True)
    assert references.keyframe.stamp == first.stamp
    assert references.last.stamp == last.stamp
    assert references.depth_reference.stamp == (first.stamp if keeps else last.stamp)
    assert policy.counts == [] and policy.begun == 0


def is_at(reference, other):
    """Return whether a frame is another one that all later ones refer to: exact in itself."""
    return (reference.prepared.stamp == other.prepared.stamp and reference.pose is other.pose
            and reference.in_keyframe is None)


@pytest.mark.parametrize('to_keyframe', [True, False])
def test_the_frame_that_serves_on_is_where_it_is(to_keyframe):
    references, first, last, policy = advance(True, to_keyframe=to_keyframe)
    served = first if to_keyframe else Reference(View(1), references.keyframe.pose)
    assert is_at(references.keyframe, served)
    np.testing.assert_array_equal(served.pose.covariance, pose_at(not to_keyframe).covariance)
    assert references.last is last
    assert policy.asked == [(last.prepared, SEEN)]


@pytest.mark.parametrize('keeps', [True, False])
def test_a_lost_frame_that_serves_on_keeps_its_doubt_and_the_next_keyframe_has_none(keeps):
    """The covariance of the next one has that doubt by then."""
    loss = Loss(Reference(View(-1), pose_at(0)), np.arange(6.0))
    references, _, _, _ = advance(keeps, loss=loss)
    assert references.keyframe.loss is (loss if keeps else None)


@pytest.mark.parametrize('before', [0, -1])
@pytest.mark.parametrize('is_by_depth', [False, True])
def test_a_frame_registered_to_one_from_before_a_loss_ends_the_doubt(is_by_depth, before):
    """The keyframe is of the time 0."""
    references, _, _, _ = advance(True, is_by_depth=is_by_depth,
                                  loss=Loss(Reference(View(before), pose_at(0)), None))
    assert (references.loss is None) == (before == 0)


def test_the_next_keyframe_is_the_last_frame_and_exact_in_itself():
    references, _, last, _ = advance(False)
    assert is_at(references.keyframe, last) and is_at(references.last, last)
    assert references.keyframe.prepared.is_bare and not references.last.prepared.is_bare


@pytest.mark.parametrize('keeps', [True, False])
def test_the_last_frame_by_depth_is_exact_in_itself_if_it_is_the_next_shape(keeps):
    references, first, last, policy = advance(keeps, is_by_depth=True)
    assert policy.asked == [(first.stamp, SEEN)]
    if keeps:
        assert references.last is last and references.depth_reference is references.keyframe
    else:
        assert is_at(references.depth_reference, last)
        assert references.last is references.depth_reference


@pytest.mark.parametrize('reference, is_kept', [('keyframe', True), ('previous', False)])
def test_the_policy_is_that_of_the_settings(reference, is_kept):
    view, exact = SimpleNamespace(
        stamp=1, keypoints=range(3), is_tracked=False, repeat=Repeat.NONE, scene_depth=1.0,
        is_blurred_beside=lambda other: False,
        bare=lambda: View(1)), PoseWithCovariance.identity()
    first, last = Reference(View(0), exact), Reference(view, exact)
    references = References(first)
    choice = KeyframeChoice(with_values(Settings(), {'odometry.reference': reference}),
                            SimpleNamespace(prepared_like=lambda target, source: target))
    choice.advance(references, last, SimpleNamespace(
        reference=first, registration=SimpleNamespace(is_by_depth=False), seen=SimpleNamespace(
            support=3, image_pose=exact, unbiased_pose=exact, T_target_source='a pose',
            fit=None, is_by_colour=False)))
    assert (references.keyframe.stamp == 0) == is_kept


def test_it_begins_with_the_policy():
    choice = KeyframeChoice(Settings(), None)
    choice._policy = Policy(True)
    choice.begin()
    assert choice._policy.begun == 1
