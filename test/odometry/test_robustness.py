# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Rendered frames with what goes wrong in front of a real camera, against the exact path.

However bad a frame is, nothing that is far off may be reported as good.
"""

import dataclasses

import cv2
import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.renderer import Renderer
from aick_ros.sources.synthetic.surfaces import Rectangle

FAR, TURNED = 0.05, np.radians(3.0)  # what is off by more must not be reported as good
PERIOD = 1 / 30


@pytest.fixture(scope='module')
def frame():
    """Return a function from a number to a rendered frame, which is rendered once."""
    source, seen = SyntheticSource(SyntheticOptions(seed=5, frames=60)), {}

    def render(index):
        if index not in seen:
            seen[index] = source.frame(index)
        return seen[index]
    render.pose = source.pose
    return render


@pytest.fixture(scope='module')
def patch():
    """Return a picture of another room, 330x310, as a camera that moves along sees it."""
    picture = SyntheticSource(SyntheticOptions(seed=77, frames=1)).frame(0).colour
    return cv2.GaussianBlur(picture, (0, 0), 1.5)[75:405, 165:475]


def off(pose, truth):
    """Return translation [m] and rotation [rad] between two poses."""
    E = se3.inverse(truth) @ pose
    return np.linalg.norm(E[:3, 3]), se3.angle(E[:3, :3])


def follow(frames, true_pose, settings=Settings()):
    """Return the updates of frames, none of which is good and far off, and the last's errors."""
    odometry, stamps = Odometry(settings), np.array([frame.stamp for frame in frames])
    updates = [odometry.register_frame(frame) for frame in frames]
    for update in updates:
        if update.status is Status.OK:
            start = update.stamp - update.increment.interval * NANOSECONDS
            before = stamps[np.abs(stamps - start).argmin()]
            motion = se3.inverse(true_pose(before)) @ true_pose(update.stamp)
            translation, rotation = off(update.increment.pose.matrix, motion)
            assert translation < FAR
            assert rotation < TURNED
    way = se3.inverse(true_pose(stamps[0])) @ true_pose(stamps[-1])
    return updates, off(updates[-1].T_odom_camera, way)


def statuses(updates):
    return [update.status for update in updates]


def cover(frame, columns):
    """Return a frame with something black and near in front of some columns."""
    colour, depth = frame.colour.copy(), frame.depth.copy()
    colour[:, columns], depth[:, columns] = 0, np.nan
    return dataclasses.replace(frame, colour=colour, depth=depth)


def late(frame, seconds):
    """Return a frame some time later, covered."""
    stamp = frame.stamp + round(seconds * NANOSECONDS)
    return dataclasses.replace(cover(frame, slice(None)), stamp=stamp, depth_stamp=None)


@pytest.mark.parametrize('width, evidence', [
    (31, [Evidence.KEYPOINTS, Evidence.KEYPOINTS]),
    (63, [Evidence.DEPTH_ALONE, Evidence.KEYPOINTS])])
def test_blurred_frames_are_followed_by_keypoints_or_by_depth(frame, width, evidence):
    smear = np.full((1, width), 1 / width, np.float32)
    shown = [frame(i) for i in range(8)]
    for i in (3, 4):
        shown[i] = dataclasses.replace(shown[i], colour=cv2.filter2D(shown[i].colour, -1, smear))
    updates, (translation, rotation) = follow(shown, frame.pose)
    assert all(update.status.ok for update in updates)
    assert [updates[i].evidence for i in (3, 4)] == evidence
    assert translation < 0.003
    assert rotation < np.radians(0.1)


@pytest.mark.parametrize('columns', [slice(320), slice(320, 640)], ids=['left', 'right'])
def test_half_the_image_covered(frame, columns):
    shown = [frame(i) for i in range(12)]
    shown[3:9] = [cover(frame, columns) for frame in shown[3:9]]
    updates, (translation, rotation) = follow(shown, frame.pose)
    assert statuses(updates) == [Status.FIRST_FRAME] + 11 * [Status.OK]
    assert translation < 0.01
    assert rotation < np.radians(0.3)


def in_front(frames, patch, speed):
    """Paste a board one metre away that moves to the right [px a frame], over a third of all."""
    shown = []
    height, width = patch.shape[:2]
    for i, frame in enumerate(frames):
        colour, depth = frame.colour.copy(), frame.depth.copy()
        place = slice(75, 75 + height), slice(10 + speed * i, 10 + speed * i + width)
        colour[place], depth[place] = patch, 1.0
        shown.append(dataclasses.replace(frame, colour=colour, depth=depth))
    return shown


@pytest.mark.parametrize('speed', [8, 20])
def test_an_object_that_moves_over_a_third_of_the_image(frame, patch, speed):
    shown = in_front([frame(i) for i in range(8)], patch, speed)
    updates, (translation, rotation) = follow(shown, frame.pose)
    share = np.mean([np.mean(np.abs(update.prepared.frame.depth[
        tuple(np.rint(update.keypoints.pixels[:, ::-1]).astype(int).T)] - 1.0) < 1e-6)
        for update in updates])
    assert 0.2 < share < 0.4  # of the keypoints are on it
    assert statuses(updates) == [Status.FIRST_FRAME] + 7 * [Status.OK]
    assert translation < 0.01
    assert rotation < np.radians(0.3)


def starting(frames, true_pose, picture, contrast):
    """Put a board of 0.75 x 0.68 m a metre away that rests, then leaves to the right at 2 m/s."""
    shown = []
    for i, frame in enumerate(frames):
        gone = 2.0 * PERIOD * max(i - 5, 0)
        corner = se3.exp([-0.45 + gone, -0.34, 1.0, 0, 0, 0])
        board = Renderer([Rectangle(true_pose(frames[5].stamp) @ corner, 0.75, 0.68, picture)],
                         frame.camera).render(true_pose(frame.stamp))
        seen = np.isfinite(board.depth)
        colour = cv2.convertScaleAbs(frame.colour, alpha=contrast, beta=128 * (1 - contrast))
        shown.append(dataclasses.replace(
            frame, colour=np.where(seen[..., None], board.colour, colour),
            depth=np.where(seen, board.depth, frame.depth)))
    return shown


@pytest.mark.parametrize('contrast', [1.0, 0.25], ids=['in the room', 'before faint walls'])
def test_an_object_with_most_of_the_keypoints_that_starts_to_move(frame, patch, contrast):
    shown = starting([frame(i) for i in range(10)], frame.pose, patch, contrast)
    updates, (translation, rotation) = follow(shown, frame.pose)
    assert statuses(updates) == [Status.FIRST_FRAME] + 9 * [Status.OK]
    told = 'move by themselves', 'tracked where the motion continues'
    assert any(words in update.reason for update in updates[6:] for words in told)
    assert translation < 0.01
    assert rotation < np.radians(0.3)


def test_a_camera_that_is_knocked(frame):
    """Frames that show four times the motion their stamps allow for: all of the view moved."""
    steps = [*range(8), 24, 40, 41, 42]
    stamps = {frame(0).stamp + round(i * PERIOD * NANOSECONDS): frame(step).stamp
              for i, step in enumerate(steps)}
    shown = [dataclasses.replace(frame(step), stamp=stamp, depth_stamp=None)
             for step, stamp in zip(steps, stamps)]
    updates, (translation, rotation) = follow(
        shown, lambda stamp: frame.pose(stamps[min(stamps, key=lambda x: abs(x - stamp))]))
    assert statuses(updates) == [Status.FIRST_FRAME] + 11 * [Status.OK]
    assert not any('move by themselves' in update.reason for update in updates)
    assert translation < 0.01
    assert rotation < np.radians(0.3)


def test_an_object_that_moves_before_a_wall(frame, patch):
    """Turning and shifting look alike there, and the object decides between them."""
    follow(in_front([frame(i) for i in range(38, 43)], patch, 8), frame.pose)


HOLES = {
    'pixels': lambda rng: rng.random((480, 640)) < 0.82,
    'patches': lambda rng: np.kron(rng.random((30, 40)) < 0.82, np.ones((16, 16))) > 0,
    'all but a strip': lambda rng: np.tile(np.arange(640) < 530, (480, 1)),
}


@pytest.mark.parametrize('holes', HOLES.values(), ids=HOLES)
def test_depth_with_holes(frame, holes):
    rng = np.random.default_rng(0)
    shown = []
    for i in range(8):
        missing = holes(rng)
        assert missing.mean() > 0.8
        depth = np.where(missing, np.float32(np.nan), frame(i).depth)
        shown.append(dataclasses.replace(frame(i), depth=depth))
    updates, (translation, rotation) = follow(shown, frame.pose)
    assert statuses(updates) == [Status.FIRST_FRAME] + 7 * [Status.OK]
    assert translation < 0.015
    assert rotation < np.radians(0.4)


WRONG_DEPTHS = {
    'one number': lambda depth, rng: np.full_like(depth, 1.0),
    'one number and noise': lambda depth, rng: rng.normal(1.0, 0.002, depth.shape),
    'a slope': lambda depth, rng: np.tile(np.linspace(1.0, 1.3, depth.shape[1]), (480, 1)),
    'of another unit': lambda depth, rng: 1.3 * depth,
    'half as large again': lambda depth, rng: 1.5 * depth,
}


@pytest.mark.parametrize('wrong', WRONG_DEPTHS.values(), ids=WRONG_DEPTHS)
@pytest.mark.parametrize('first', [4, 9, 12])
def test_depths_that_are_not_of_the_scene_are_not_believed(frame, wrong, first):
    """
    Three frames of them in a furnished room: none is far off, and what follows is as before.

    Where they are registered to each other, what follows is found from the frame before them.
    """
    rng, shown = np.random.default_rng(0), [frame(i) for i in range(first + 7)]
    for i in range(first, first + 3):
        depth = wrong(shown[i].depth, rng).astype(np.float32)
        shown[i] = dataclasses.replace(shown[i], depth=depth)
    updates, (translation, rotation) = follow(shown, frame.pose)
    for update in updates:
        way = se3.inverse(frame.pose(shown[0].stamp)) @ frame.pose(update.stamp)
        error = se3.difference(update.pose.matrix, way)[:3]
        assert np.linalg.norm(error) < 0.035
        if update.status.ok:
            sigma = np.sqrt(np.trace(update.pose.covariance[:3, :3]))
            assert np.linalg.norm(error) < max(4.0 * sigma, 0.005)
            assert np.linalg.norm(error) < 0.005 or update.stamp < shown[first + 4].stamp
        if update.increment is not None and update.status.ok:
            motion = update.increment.pose
            start = update.stamp - round(update.increment.interval * NANOSECONDS)
            true = se3.inverse(frame.pose(start)) @ frame.pose(update.stamp)
            error = np.linalg.norm(se3.difference(motion.matrix, true)[:3])
            sigma = np.sqrt(np.trace(motion.covariance[:3, :3]))
            assert error < max(4.0 * sigma, 0.005)
    assert statuses(updates)[-3:] == 3 * [Status.OK]
    assert translation < 0.01
    assert rotation < np.radians(0.3)


def test_a_wall_of_one_depth_is_believed():
    """A simulated camera that looks straight at a wall measures one number, without noise."""
    camera = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    rng = np.random.default_rng(0)
    picture = cv2.GaussianBlur(rng.uniform(0, 255, (1200, 1600)), (0, 0), 3.0)
    picture = cv2.normalize(picture, None, 0, 255, cv2.NORM_MINMAX, cv2.CV_8U)
    odometry, scale, distances = Odometry(), 2.0, np.linspace(1.5, 1.2, 12)
    for i, z in enumerate(distances):
        zoom = scale * z / camera.fx * 262.5 / 1.5
        affine = np.float32([[zoom, 0, 800 - zoom * camera.cx], [0, zoom, 600 - zoom * camera.cy]])
        seen = cv2.warpAffine(picture, affine, (320, 240), flags=cv2.WARP_INVERSE_MAP)
        update = odometry.register_frame(RgbdFrame(
            (i + 1) * 10 ** 8, seen, np.full((240, 320), z, np.float32), camera))
        assert update.status.ok, update.reason
        moved = distances[0] - z
        np.testing.assert_allclose(update.pose.matrix[:3, 3], [0, 0, moved], atol=0.02)


def test_three_of_four_frames_missing(frame):
    updates, (translation, rotation) = follow([frame(i) for i in range(0, 24, 4)], frame.pose)
    assert statuses(updates) == [Status.FIRST_FRAME] + 5 * [Status.OK]
    assert translation < 0.01
    assert rotation < np.radians(0.3)


def test_covered_for_a_second(frame):
    """The camera has gone on by half a metre, and is found again without a jump."""
    dark = [late(frame(8), i * PERIOD) for i in range(1, 31)]
    updates, (translation, rotation) = follow(
        [*[frame(i) for i in range(9)], *dark, frame(39), frame(40)], frame.pose)
    assert statuses(updates)[9:39] == 30 * [Status.TOO_FEW_KEYPOINTS]
    assert statuses(updates)[39:] == 2 * [Status.OK]
    assert [update.recovered for update in updates[-2:]] == [True, False]
    assert updates[-2].increment.interval == pytest.approx(31 * PERIOD)
    assert translation < 0.01
    assert rotation < np.radians(0.3)


@pytest.mark.parametrize('reference', ['previous', 'keyframe'])
def test_a_camera_lifted_while_a_hand_goes_over_it_is_found_by_an_earlier_frame(frame, reference):
    """The last frame before the dark and the first after it show nothing in common."""
    before = [*[frame(i) for i in range(0, 20, 4)], cover(frame(20), slice(200, 640))]
    dark = [late(frame(20), i * PERIOD) for i in range(1, 19)]
    updates, (translation, rotation) = follow(
        [*before, *dark, cover(frame(39), slice(320)), frame(40)], frame.pose,
        with_values(Settings(), {'odometry.reference': reference}))
    assert statuses(updates)[1:6] == 5 * [Status.OK]
    found = updates[-2]
    assert found.status is Status.OK
    assert found.recovered
    assert found.increment.interval > 18 * PERIOD
    assert any(found.reference.stamp == update.keypoints.stamp for update in updates[:5])
    assert translation < 0.01
    assert rotation < np.radians(0.3)
