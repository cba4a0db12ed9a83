# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The frames that a new frame is registered to, and motions between frames of one keyframe."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.reference import Loss, Reference, References
from aick_ros.registration.result import Evidence, Registration, SensorBias
from aick_ros.registration.status import Status
from aick_ros.settings import OdometrySettings

ORIGIN = PoseWithCovariance.identity()
VIEW = SimpleNamespace(scene_depth=2.0)


def registered_at(pose, systematic=np.zeros((6, 6)), bias=None):
    """Return a registration with a pose, and a systematic error besides."""
    return Registration(Status.OK, '', pose.matrix, pose.covariance + systematic,
                        np.empty((0, 2), np.intp), 1, systematic=systematic, bias=bias)


def drawn_bias(rng):
    """Return a small bias with a covariance and a gain of its own."""
    root, gain = rng.normal(0, 1e-3, (6, 6)), rng.normal(0, 0.3, (6, 6))
    return SensorBias(rng.normal(0, 1e-5, 6), root @ root.T, gain, root @ root.T)


@pytest.fixture
def poses():
    rng = np.random.default_rng(5)
    return [se3.exp(rng.normal(0, 0.3, 6)) for _ in range(2)]


def test_errors_of_two_poses_in_a_keyframe_are_one_of_the_motion_between_them(poses):
    errors = 1e-5 * np.random.default_rng(7).normal(size=(2, 6))
    off = [se3.perturbed(*each) for each in zip(poses, errors)]
    registered = [dataclasses.replace(registered_at(PoseWithCovariance(pose)), by_readout=by)
                  for pose, by in zip(poses, errors)]
    before = Reference(VIEW, ORIGIN, registered[0].pose, by_readout=errors[0])
    expected = se3.difference(se3.inverse(off[0]) @ off[1], se3.inverse(poses[0]) @ poses[1])
    np.testing.assert_allclose(before.readout_error(registered[1]), expected, atol=1e-9)
    of_keyframe = Reference(VIEW, ORIGIN)
    np.testing.assert_array_equal(of_keyframe.readout_error(registered[1]), errors[1])


def test_the_motion_between_two_frames_of_a_keyframe(poses):
    """Three frames with equal noise: the keyframe's is in both registrations and cancels."""
    rng = np.random.default_rng(6)
    deviation = 1e-4
    registered = [PoseWithCovariance(pose, 2 * deviation ** 2 * np.eye(6)) for pose in poses]
    motion, bias = Reference(VIEW, ORIGIN, registered[0]).motion_to(registered_at(registered[1]))
    assert bias is None
    np.testing.assert_allclose(motion.matrix, se3.inverse(poses[0]) @ poses[1], atol=1e-12)
    errors = []
    for _ in range(4000):
        common, *own = rng.normal(0, deviation, (3, 6))
        seen = [se3.perturbed(pose, noise - common) for pose, noise in zip(poses, own)]
        found = se3.inverse(seen[0]) @ seen[1]
        errors.append(se3.difference(found, motion.matrix))
    found = np.cov(np.array(errors).T)
    # the lever arm of the keyframe's rotation does not cancel: within a quarter, rotations exact
    assert np.trace(motion.covariance[3:, 3:]) == pytest.approx(np.trace(found[3:, 3:]), rel=0.1)
    assert np.trace(motion.covariance[:3, :3]) == pytest.approx(np.trace(found[:3, :3]), rel=0.25)


@pytest.mark.parametrize('is_known', [True, False])
def test_the_motion_from_a_keyframe_is_its_registration(poses, is_known):
    """The bias expected is left to what the bias shows, where that is known."""
    noise, systematic = np.diag(np.arange(1.0, 7.0)), 3.0 * np.eye(6)
    bias = drawn_bias(np.random.default_rng(1)) if is_known else None
    registration = registered_at(PoseWithCovariance(poses[0], noise), systematic, bias)
    found, shown = Reference(VIEW, ORIGIN).motion_to(
        dataclasses.replace(registration, unusual=0.5 * noise))
    assert shown is bias
    np.testing.assert_allclose(found.matrix, poses[0], atol=1e-12)
    np.testing.assert_allclose(found.covariance, noise if is_known else noise + systematic,
                               atol=1e-12)


@pytest.mark.parametrize('evidence', Evidence)
def test_by_depth_alone_what_is_expected_of_the_bias_is_in_no_motion(poses, evidence):
    """What it has of the bias is the same in all frames that are registered to one image."""
    noise, systematic = np.diag(np.arange(1.0, 7.0)), 3.0 * np.eye(6)
    registration = dataclasses.replace(
        registered_at(PoseWithCovariance(poses[0], noise), systematic, None), evidence=evidence)
    found, _ = Reference(VIEW, ORIGIN).motion_to(registration)
    expected = noise if evidence is Evidence.DEPTH_ALONE else noise + systematic
    np.testing.assert_allclose(found.covariance, expected, atol=1e-12)


def test_what_two_registrations_have_in_common_is_no_error_of_the_motion(poses):
    """However large it is, and however far the camera moves between them."""
    noise = 1e-6 * np.eye(6)
    first, second = (PoseWithCovariance(pose, noise) for pose in poses)
    before = Reference(VIEW, ORIGIN, first)
    plain, biased = registered_at(second), registered_at(second, np.eye(6))
    unusual = dataclasses.replace(biased, covariance=biased.covariance + np.eye(6),
                                  unusual=np.eye(6))
    motions = [before.motion_to(found)[0].covariance for found in (plain, biased, unusual)]
    np.testing.assert_allclose(motions[1], motions[0], atol=1e-12)
    np.testing.assert_allclose(motions[2], motions[0], atol=1e-12)


@pytest.mark.parametrize('before_by, now_by, own, is_biased', [
    (Evidence.KEYPOINTS, Evidence.KEYPOINTS, 0.5, False),
    (Evidence.COLOUR_ALONE, Evidence.COLOUR_ALONE, 0.15, False),
    (Evidence.COLOUR_ALONE, Evidence.KEYPOINTS, 0.5, True),
    (Evidence.KEYPOINTS, Evidence.COLOUR_ALONE, 0.5, True)])
def test_by_colour_alone_the_depth_of_the_keyframe_is_common_and_a_bias_to_depth_is_not(
        poses, before_by, now_by, own, is_biased):
    noise, systematic = 1e-6 * np.eye(6), 3e-6 * np.eye(6)
    first, second = (PoseWithCovariance(pose, noise) for pose in poses)
    before = Reference(VIEW, ORIGIN, first, is_by_colour=before_by is Evidence.COLOUR_ALONE)
    found, shown = before.motion_to(dataclasses.replace(
        registered_at(second, systematic), evidence=now_by))
    np.testing.assert_allclose(
        found.covariance, own * second.relative_to(first).covariance + is_biased * systematic,
        atol=1e-15)
    assert shown is None


def test_the_bias_of_a_motion_is_what_the_two_kinds_say_of_it(poses):
    """By keypoints alone and by depth alone, each pose in the keyframe off by its own error."""
    rng = np.random.default_rng(7)
    biases = [drawn_bias(rng) for _ in poses]
    before = Reference(VIEW, ORIGIN, PoseWithCovariance(poses[0], np.eye(6)), biases[0])
    _, shown = before.motion_to(registered_at(
        PoseWithCovariance(poses[1], np.eye(6)), bias=biases[1]))
    by_keypoints = se3.inverse(se3.perturbed(poses[0], biases[0].difference)) @ se3.perturbed(
        poses[1], biases[1].difference)
    by_depth = se3.inverse(poses[0]) @ poses[1]
    np.testing.assert_allclose(shown.difference, se3.difference(by_keypoints, by_depth),
                               atol=1e-8)
    of_noise = [PoseWithCovariance(pose, bias.covariance) for pose, bias in zip(poses, biases)]
    np.testing.assert_allclose(shown.covariance,
                               0.5 * of_noise[1].relative_to(of_noise[0]).covariance, atol=1e-15)
    # by how much depth moves the second pose, seen by the first camera
    error, turn = rng.normal(0, 1.0, 6), poses[0][:3, :3]
    moved = (biases[1].gain @ error).reshape(2, 3) @ turn
    np.testing.assert_allclose(shown.gain @ (error.reshape(2, 3) @ turn).ravel(), moved.ravel(),
                               atol=1e-12)


def test_images_do_not_know_errors_of_their_stamps(poses):
    """To the keyframe, whose bias is known or not, and between two frames of it."""
    noise, stamps = 1e-6 * np.eye(6), np.diag(np.arange(6.0))
    first, second = (PoseWithCovariance(pose, noise) for pose in poses)
    bias = drawn_bias(np.random.default_rng(3))
    for before in (Reference(VIEW, ORIGIN, first), Reference(VIEW, ORIGIN)):
        for of_bias in (None, bias):
            plain = registered_at(second, bias=of_bias)
            late = dataclasses.replace(plain, covariance=plain.covariance + stamps, timing=stamps)
            np.testing.assert_allclose(before.motion_to(late)[0].covariance,
                                       before.motion_to(plain)[0].covariance, atol=1e-12)


@pytest.mark.parametrize('known', [0, 1])
def test_of_one_bias_alone_none_of_the_motion_is_known(poses, known):
    first, second = (PoseWithCovariance(pose, np.eye(6)) for pose in poses)
    biases = [drawn_bias(np.random.default_rng(2)) if i == known else None for i in range(2)]
    before = Reference(VIEW, ORIGIN, first, biases[0])
    assert before.motion_to(registered_at(second, bias=biases[1]))[1] is None


class View:
    """A frame at a time [s], with a sharpness in place of an image."""

    def __init__(self, seconds, sharpness):
        self.stamp, self.sharpness = round(seconds * NANOSECONDS), sharpness
        self.is_bare = False

    def is_blurred_beside(self, other):
        return self.sharpness < other.sharpness

    def bare(self):
        bare = View(0, self.sharpness)
        bare.stamp, bare.is_bare = self.stamp, True
        return bare


def reference(seconds, sharpness=1):
    return Reference(View(seconds, sharpness), ORIGIN)


def tracked(times, keyframe=None):
    """Return the references after frames at some times [s]; without a keyframe each is one."""
    references = References(reference(times[0]))
    for seconds in times[1:]:
        last = reference(seconds)
        references.track(last, last if keyframe is None else reference(keyframe))
    return references


def seconds(references, prepared=View(9.0, 1)):
    return [candidate.stamp / NANOSECONDS for candidate in references.candidates(prepared)]


def test_the_keyframe_comes_first_then_the_last_frame_then_an_earlier_one():
    assert seconds(tracked([0.0])) == [0.0]
    assert seconds(tracked([0.0, 0.1, 0.2], keyframe=0.1)) == [0.1, 0.2, 0.0]


def test_earlier_frames_are_three_tenths_of_a_second_apart():
    references = tracked([i / 10 for i in range(14)])
    in_turn = set()
    for i in range(4):
        in_turn |= set(seconds(references))
        references.lose(reference(2.0 + i / 10))
    assert in_turn == {1.3, 1.2, 0.9, 0.6} | {2.0, 2.1, 2.2}


def test_the_last_frame_alone_keeps_all_of_its_images():
    """The next one is compared with them."""
    references = tracked([0.0])
    assert references.keyframe.prepared.is_bare and references.sharp is references.keyframe
    assert not references.last.prepared.is_bare
    references = tracked([i / 10 for i in range(14)], keyframe=1.25)
    assert not references.last.prepared.is_bare
    assert [one.prepared.is_bare for one in references._earlier] == [True] * 3


def test_a_keyframe_is_not_a_candidate_twice():
    references = tracked([0.0, 0.1, 0.5], keyframe=0.0)
    assert seconds(references) == [0.0, 0.5]


@pytest.mark.parametrize('lost', range(8))
def test_at_most_three_candidates_and_in_turn_all(lost):
    """Lost frames in a row: each is compared with the keyframe and the lost one before it."""
    references = tracked([i / 10 for i in range(14)], keyframe=1.25)
    for i in range(lost):
        references.lose(reference(2.0 + i / 10))
    found = seconds(references)
    assert len(found) == 3
    assert found[0] == 1.25
    if lost:
        in_turn = [1.3, 1.2, 0.9, 0.6]
        assert found[1:] == [in_turn[(lost - 1) % 4], 2.0 + (lost - 1) / 10]


@pytest.mark.parametrize('found', [1.2, 1.3, 2.0])
def test_the_last_frame_before_a_loss_is_tried_until_one_from_before_it_is_found(found):
    """Frames that agree with a lost one alone may all be wrong."""
    references = tracked([i / 10 for i in range(14)], keyframe=1.25)
    references.lose(Reference(View(2.0, 1), ORIGIN, loss=Loss(references.last.bare(), None)))
    references.confirm(reference(found))
    references.track(reference(2.1), reference(2.0))
    assert seconds(references) == [2.0, *([] if found < 2.0 else [1.3]), 2.1,
                                   *([1.2] if found < 2.0 else [])]
    assert found < 2.0 or list(references.candidates(View(9.0, 1)))[1].prepared.is_bare


def test_of_frames_before_and_after_a_loss_no_motion_between_them_is_known():
    references = tracked([0.0, 0.1, 0.2], keyframe=0.0)
    loss = Loss(references.last.bare(), None)
    before, after = (0, references.last.stamp), (references.last.stamp + 1, 9 * NANOSECONDS)
    references.lose(Reference(View(1.0, 1), ORIGIN, loss=loss))
    assert references.are_linked(*before) and references.are_linked(*after)
    assert not any(references.are_linked(*pair)
                   for one in before for other in after for pair in ((one, other), (other, one)))
    references.confirm(references.keyframe)
    assert references.are_linked(before[0], after[0])


@pytest.mark.parametrize('is_lost', [True, False])
def test_after_a_blur_the_sharp_keyframe_comes_first_and_once(is_lost):
    """Of three references, of which a lost one is the last."""
    references = tracked([0.0, 0.4, 0.8], keyframe=0.0)
    blurred = reference(0.9, sharpness=0)
    references.track(blurred, blurred)
    if is_lost:
        references.lose(Reference(View(1.0, 1), ORIGIN))
    assert seconds(references) == [0.0, 0.9, 1.0 if is_lost else 0.8]
    assert seconds(references, View(9.0, 0))[0] == 0.9


def test_after_a_tracked_frame_the_lost_ones_are_forgotten():
    references = tracked([0.0, 0.4, 0.8])
    for i in range(2):
        references.lose(reference(1.0 + i / 10))
    references.track(reference(1.4), reference(1.4))
    assert seconds(references) == [1.4, 0.8, 0.4]


def test_during_a_blur_the_last_sharp_keyframe_is_kept():
    references = References(reference(0.0))
    for time, sharpness, sharp in [(0.1, 1, 0.1), (0.2, 0, 0.1), (0.3, 0, 0.1), (0.4, 1, 0.4)]:
        keyframe = reference(time, sharpness)
        references.track(keyframe, keyframe)
        assert references.sharp.stamp == round(sharp * NANOSECONDS)
        assert references.is_blurred() == (time != sharp)


def test_a_frame_registered_to_the_sharp_keyframe_ends_a_blur():
    references = References(reference(0.0))
    sharp, blurred = references.sharp, reference(0.1, 0)
    assert not references.is_return_to(sharp)
    references.track(blurred, blurred)
    assert references.is_return_to(sharp)
    assert not references.is_return_to(blurred)


def test_an_earlier_keyframe_that_serves_again_is_the_sharp_one():
    references = tracked([0.0, 0.4, 0.8])
    references.track(reference(1.0), reference(0.4))
    assert references.sharp.stamp == references.keyframe.stamp == round(0.4 * NANOSECONDS)
    assert not references.is_blurred()


def test_what_stays_blurred_is_how_the_camera_sees():
    for late in (-1, 0):  # ns beside five seconds
        references = References(reference(100.0))
        keyframe = reference(105.0 + late / NANOSECONDS, 0)
        references.track(keyframe, keyframe)
        assert references.is_blurred() == (late < 0)


def test_by_depth_alone_the_keyframe_stays_and_the_shape_is_tried_before_the_last_frame():
    references = tracked([0.0, 0.1], keyframe=0.0)
    assert [one.stamp for one in references.depth_references()] == [references.last.stamp]
    shape, dark = references.last, reference(0.2)
    references.track_by_depth(dark, shape)
    assert list(references.depth_references()) == [shape, dark]
    assert references.keyframe.stamp == 0
    references.track(dark, references.keyframe)
    assert list(references.depth_references()) == [dark]


def test_what_was_lost_before_a_frame_by_depth_is_forgotten():
    references = tracked([i / 10 for i in range(14)], keyframe=1.25)
    before = seconds(references)
    for i in range(2):
        references.lose(reference(2.0 + i / 10))
    assert seconds(references) != before
    references.track_by_depth(references.last, references.last)
    assert seconds(references) == before


def test_a_frame_lost_in_the_dark_is_kept_until_another_one_is_tracked_or_has_keypoints():
    references, lost = tracked([0.0, 0.1]), reference(1.0)
    for end in (lambda: references.track(references.last, references.keyframe),
                lambda: references.track_by_depth(references.last, references.last),
                lambda: references.lose(reference(2.0))):
        references.lose_in_the_dark(lost)
        assert references.lost_in_the_dark is lost
        end()
        assert references.lost_in_the_dark is None


def test_any_frame_that_keypoints_find_ends_the_dark():
    references = tracked([0.0, 0.1, 0.2], keyframe=0.1)
    found = [references.keyframe, references.last, references.sharp]
    assert not any(map(references.is_return_to, found))
    references.track_by_depth(references.last, references.last)
    assert all(map(references.is_return_to, found))


def test_the_last_frame_that_is_the_shape_is_tried_once():
    references = tracked([0.0, 0.1], keyframe=0.0)
    references.track_by_depth(references.last, references.last)
    assert list(references.depth_references()) == [references.last]


HOLDING = dataclasses.replace(OdometrySettings(), hold_time=0.3)


@pytest.mark.parametrize('after, is_known', [(0.3, True), (0.31, False)])
def test_before_a_loss_the_velocity_is_known_as_long_as_it_holds(after, is_known):
    references, twist, model = References(reference(1.0)), np.ones(6), MotionModel(HOLDING)
    loss = references.loss_before(round((1.0 + after) * NANOSECONDS), twist, model)
    assert loss.last.stamp == references.last.stamp
    assert loss.twist is (twist if is_known else None)


@pytest.mark.parametrize('after, is_in_doubt', [(0.3, True), (0.31, False)])
def test_an_earlier_loss_counts_as_long_as_it_is_in_doubt(after, is_in_doubt):
    references, model = References(reference(1.0)), MotionModel(HOLDING)
    earlier = references.loss_before(round(1.1 * NANOSECONDS), np.ones(6), model)
    references.lose(dataclasses.replace(reference(1.1), loss=earlier))
    references.track(reference(1.2), reference(1.2))
    again = references.loss_before(round((1.0 + after) * NANOSECONDS), None, model)
    assert (again is earlier) == is_in_doubt
    assert again.last.stamp == round((1.0 if is_in_doubt else 1.2) * NANOSECONDS)
