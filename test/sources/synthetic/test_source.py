# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The rendered recording: its ground truth, its keypoints, and that it is always the same."""

import dataclasses
import itertools

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.settings import FeatureSettings, SensorSettings
from aick_ros.sources.synthetic import ColourSensor, DepthSensor, SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS
from aick_ros.sources.synthetic.renderer import Renderer
from aick_ros.sources.synthetic.room import furnished_room

SMALL = Camera(160, 120, 131.25, 131.25, 79.5, 59.5)
EXTRACTOR = KeypointExtractor(FeatureSettings(max_keypoints=0), SensorSettings())


def seen_again(source, first, second):
    """Return where the pixels of a frame lie in another, their depth and that seen there."""
    frames = source.frame(first), source.frame(second)
    camera = frames[0].camera
    pixels = np.stack(np.meshgrid(np.arange(4, camera.width, 8), np.arange(4, camera.height, 8)),
                      axis=-1).reshape(-1, 2)
    points = camera.back_project(pixels, frames[0].depth[pixels[:, 1], pixels[:, 0]])
    T_second_first = se3.inverse(source.ground_truth.poses[second]) @ (
        source.ground_truth.poses[first])
    points = se3.transform(T_second_first, points)
    places = camera.project(points).astype(np.float32)
    inside = np.all((places > 1) & (places < (camera.width - 2, camera.height - 2)), axis=1)
    pixels, places, depth = pixels[inside], places[inside], points[inside, 2]
    look_up = [np.ascontiguousarray(a)[None] for a in places.T]
    inverse = cv2.remap(1 / frames[1].depth, *look_up, cv2.INTER_LINEAR)[0]
    colours = (frames[0].colour[pixels[:, 1], pixels[:, 0]].astype(float),
               cv2.remap(frames[1].colour, *look_up, cv2.INTER_LINEAR)[0].astype(float))
    return depth, 1 / inverse, colours


@pytest.mark.parametrize('pair', [(0, 1), (20, 30), (80, 60)])
def test_depth_agrees_with_the_ground_truth(perfect, pair):
    predicted, seen, _ = seen_again(perfect, *pair)
    error = np.abs(predicted - seen)
    assert len(error) > 1000
    # half a pixel of error would be more than a millimetre; OpenCV 4 looks up to 1/32 of a pixel
    assert np.median(error) < 2e-4
    # the rest is hidden in one of the two, or at an edge
    assert np.mean(error < 1e-3) > 0.8


@pytest.mark.parametrize('pair', [(0, 1), (20, 30), (80, 60)])
def test_colour_agrees_with_the_ground_truth(perfect, pair):
    predicted, seen, (before, after) = seen_again(perfect, *pair)
    same = np.abs(predicted - seen) < 1e-3
    difference = np.abs(before - after)[same].mean(axis=1)
    assert np.median(difference) < 3.0
    # as a check of the check: colours of other places differ far more
    assert np.median(np.abs(before - np.roll(after, 40, axis=0)).mean(axis=1)) > 10.0


def test_views_show_structure_at_the_distances_a_kinect_measures(noisy):
    for index in range(0, len(noisy), 15):
        depth = noisy.frame(index).depth
        assert 0.6 < np.nanmedian(depth) < 5.0
        assert np.isfinite(depth).mean() > 0.8


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_a_camera_may_go_anywhere_in_the_free_zone(room, seed):
    scene = room(seed)
    wide = Camera(48, 48, 24.0, 24.0, 23.5, 23.5)
    renderer = Renderer(scene.surfaces, wide)
    rays = np.linalg.norm(wide.back_project(
        np.stack(np.meshgrid(range(48), range(48)), -1).reshape(-1, 2), np.ones(48 * 48)), axis=1)
    turns = [(0, k * np.pi / 2, 0) for k in range(4)] + [(np.pi / 2, 0, 0), (-np.pi / 2, 0, 0)]
    low, high = scene.free.low, scene.free.high
    for corner in itertools.product(*zip(low, high)):
        for turn in turns:
            T_world_camera = np.eye(4)
            T_world_camera[:3, :3], T_world_camera[:3, 3] = se3.exp_rotation(turn), corner
            distance = renderer.render_depth(T_world_camera).ravel() * rays
            # nothing is near, and the room is closed
            assert distance.min() > 0.3
            assert distance.max() < 8.0
            # what keeps cameras off encloses all that is seen, but pictures flat on a wall
            assert scene.clearance(np.array([corner]))[0] < distance.min() + 0.05


def test_the_same_seed_gives_the_same_room(room):
    once, again = room(1), furnished_room(1)
    assert all(np.array_equal(a.image, b.image)
               for a, b in zip(once.surfaces, again.surfaces, strict=True))
    np.testing.assert_array_equal(once.free.low, again.free.low)


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_every_view_has_several_hundred_keypoints_with_depth(room, seed):
    source = SyntheticSource(SyntheticOptions(seed=seed), room(seed))
    counts = [len(EXTRACTOR.extract(source.frame(i))) for i in range(0, len(source), 10)]
    assert min(counts) > 400


def test_keypoints_are_found_again_in_the_next_frame(noisy):
    shares = []
    for index in (10, 60, 110):
        one, other = (EXTRACTOR.extract(noisy.frame(i)) for i in (index, index + 1))
        poses = noisy.ground_truth.poses
        T_other_one = se3.inverse(poses[index + 1]) @ poses[index]
        moved = se3.transform(T_other_one, one.positions)
        pixels = noisy.frame(index).camera.project(moved)
        inside = np.all((pixels > 10) & (pixels < (630, 470)), axis=1)
        nearest = np.linalg.norm(pixels[inside, None] - other.pixels[None], axis=2).min(axis=1)
        shares.append(np.mean(nearest < 2.0))
    assert min(shares) > 0.6


def test_frames_are_always_the_same(perfect):
    options = SyntheticOptions(seed=1, frames=4, camera=SMALL)
    once, again = (SyntheticSource(options, perfect.scene) for _ in range(2))
    alone = again.frame(3)
    in_order = list(once.frames(pytest.fail))
    assert len(in_order) == len(once) == 4
    for frame, other in zip(in_order, [again.frame(i) for i in range(4)]):
        assert frame.stamp == other.stamp
        assert np.array_equal(frame.colour, other.colour)
        assert np.array_equal(frame.depth, other.depth, equal_nan=True)
    assert np.array_equal(alone.colour, in_order[3].colour)


def test_another_seed_is_another_room_and_another_path(room):
    here = SyntheticSource(SyntheticOptions.perfect(seed=1, camera=SMALL), room(1))
    there = SyntheticSource(SyntheticOptions.perfect(seed=2, camera=SMALL), room(2))
    apart = here.ground_truth.poses[:, :3, 3] - there.ground_truth.poses[:, :3, 3]
    assert np.linalg.norm(apart, axis=1).min() > 0.01
    # the one room and the other from the same place
    elsewhere = SyntheticSource(SyntheticOptions.perfect(seed=1, camera=SMALL), there.scene)
    for index in (0, 75, 149):
        one, other = here.frame(index), elsewhere.frame(index)
        assert np.mean(np.abs(one.depth - other.depth) > 0.01) > 0.5
        assert np.median(np.abs(one.colour.astype(float) - other.colour)) > 10


def test_stamps_are_exact(perfect):
    options = SyntheticOptions.perfect(seed=1, frames=91, camera=SMALL)
    source = SyntheticSource(options, perfect.scene)
    stamps = source.ground_truth.stamps
    assert stamps[0] == source.frame(0).stamp == 1_000_000_000_000
    assert stamps[30] - stamps[0] == 1_000_000_000
    assert stamps[90] - stamps[0] == 3_000_000_000
    assert set(np.diff(stamps)) == {33_333_333, 33_333_334}


def test_depth_may_be_taken_later_than_colour(perfect):
    delay = 0.017
    camera = perfect.frame(0).camera
    late = SyntheticSource(SyntheticOptions.perfect(seed=1, depth_delay=delay), perfect.scene)
    frame = late.frame(40)
    assert frame.depth_stamp - frame.stamp == 17_000_000
    assert np.array_equal(frame.colour, perfect.frame(40).colour)
    # points seen in the depth image lie, by the pose of its own time, on the walls of frame 40
    pixels = np.stack(np.meshgrid(np.arange(50, 600, 10), np.arange(50, 430, 10)),
                      axis=-1).reshape(-1, 2)
    points = camera.back_project(pixels, frame.depth[pixels[:, 1], pixels[:, 0]])

    def error(T_world_depth):
        T_colour_depth = se3.inverse(perfect.ground_truth.poses[40]) @ T_world_depth
        moved = se3.transform(T_colour_depth, points)
        look_up = camera.project(moved).astype(np.float32)
        seen = cv2.remap(1 / perfect.frame(40).depth, *np.ascontiguousarray(look_up.T)[:, None],
                         cv2.INTER_LINEAR, borderValue=np.nan)[0]
        return np.nanmedian(np.abs(moved[:, 2] - 1 / seen))

    assert error(late.pose(frame.depth_stamp)) < 1e-4
    assert error(late.pose(frame.stamp)) > 1e-3


def test_motion_blur_is_the_mean_over_the_exposure(perfect):
    shutter = 0.03
    colour = ColourSensor(sigma=0.0, shutter=shutter, exposure_swing=0.0)
    blurred = SyntheticSource(SyntheticOptions.perfect(seed=1, colour=colour), perfect.scene)
    index = int(np.argmax([se3.angle(one[:3, :3].T @ other[:3, :3]) for one, other in zip(
        perfect.ground_truth.poses, perfect.ground_truth.poses[1:])]))
    stamp = int(perfect.ground_truth.stamps[index])
    times = stamp + ((np.arange(12) + 0.5) / 12 - 0.5) * shutter * 1e9
    renderer = Renderer(perfect.scene.surfaces, perfect.frame(0).camera)
    true = np.mean([renderer.render(perfect.pose(int(t))).colour for t in times], axis=0)
    smeared = np.abs(blurred.frame(index).colour - true).mean()
    sharp = np.abs(perfect.frame(index).colour - true).mean()
    assert smeared < 0.25 * sharp


def test_exposure_rolls_slowly(perfect):
    colour = ColourSensor(sigma=0.0, shutter=0.0, exposure_swing=0.2)
    options = SyntheticOptions.perfect(seed=1, frames=300, camera=SMALL, colour=colour)
    rolling = SyntheticSource(options, perfect.scene)
    steady = SyntheticSource(SyntheticOptions.perfect(seed=1, frames=300, camera=SMALL),
                             perfect.scene)
    gains = []
    for index in range(0, 300, 10):
        before, after = steady.frame(index).colour, rolling.frame(index).colour
        middling = (before > 60) & (before < 180)
        gains.append(np.mean(after[middling] / before[middling]))
    assert 0.79 < min(gains) < 0.95
    assert 1.05 < max(gains) < 1.21
    assert np.abs(np.diff(gains)).max() < 0.15


def test_size_rate_and_intrinsics_are_the_given_ones(perfect):
    options = SyntheticOptions(seed=1, frames=3, rate=10.0, camera=SMALL)
    frame = SyntheticSource(options, perfect.scene).frame(2)
    assert frame.camera == SMALL
    assert frame.colour.shape == (120, 160, 3)
    assert frame.stamp == 1_000_200_000_000
    with pytest.raises(IndexError):
        SyntheticSource(options, perfect.scene).frame(3)


@pytest.mark.parametrize('options, message', [
    ({'frames': 0}, 'frames 1 to 100000'),
    ({'frames': 10 ** 18}, 'frames 1 to 100000'),
    ({'seed': -1}, 'seed must be 0 to'),
    ({'seed': 10 ** 30}, 'seed must be 0 to'),
    ({'rate': 0.0}, 'rate is 0 Hz'),
    ({'rate': float('nan')}, 'rate is nan'),
    ({'rate': 1e12}, r'rate is 1e\+12 Hz: it must be 0.01 to 1000'),
    ({'rate': 1e-12}, 'rate is 1e-12 Hz: it must be 0.01 to 1000'),
    ({'depth_delay': float('inf')}, 'depth delay'),
    ({'camera': Camera(64, 48, 50, 50, 32, 24, 'plumb_bob', (0.1, 0, 0, 0))}, 'distortion')])
def test_unusable_options_are_rejected(options, message):
    with pytest.raises(InputError, match=message):
        SyntheticOptions(**options)


def test_perfect_options_keep_the_others():
    options = SyntheticOptions.perfect(seed=4, rate=15.0)
    assert (options.seed, options.rate) == (4, 15.0)
    assert options.depth == DepthSensor.perfect()
    assert SyntheticOptions.perfect(depth=DepthSensor()).depth == DepthSensor()


def test_each_frame_has_the_samples_that_arrived_since_the_one_before(perfect):
    """An image takes 20 ms longer; the first has those of half a second before it, too."""
    options = SyntheticOptions.perfect(seed=1, frames=4, camera=SMALL, imu=IMU_MODELS['perfect'])
    source = SyntheticSource(options, perfect.scene)
    assert perfect.imu is None and perfect.frame(0).imu is None
    assert source.imu.stamps[0] == options.start - 500_000_000
    stamps = source.ground_truth.stamps
    received = [source.frame(i).imu.stamps for i in (0, 1, 2, 3)]
    arrived = source.imu.stamps[source.imu.stamps <= stamps[-1] + 20_000_000]
    np.testing.assert_array_equal(np.concatenate(received), arrived)
    for stamp, own in zip(stamps, received):
        assert stamp + 15_000_000 < own[-1] <= stamp + 20_000_000
    # in the axes of the camera, which holds still enough: gravity upwards
    up = perfect.pose(int(stamps[1])).T[:3, :3] @ (0, 0, 1)
    force = source.frame(1).imu.accelerations.mean(axis=0)
    assert force @ up / np.linalg.norm(force) > 0.98


def test_the_noise_of_each_image_is_its_own(perfect):
    """Of one frame it is always the same; that of another one, or seed, has nothing of it."""
    def noise(seed, index):
        options = SyntheticOptions.perfect(
            seed=seed, frames=3, camera=SMALL, depth=dataclasses.replace(
                DepthSensor.perfect(), sigma=0.01))
        exact = SyntheticSource(dataclasses.replace(options, depth=DepthSensor.perfect()),
                                perfect.scene)
        seen = SyntheticSource(options, perfect.scene)
        return (1 / seen.frame(index).depth - 1 / exact.frame(index).depth).ravel()
    first = noise(1, 1)
    np.testing.assert_array_equal(first, noise(1, 1))
    for other in (noise(1, 2), noise(1, 0), noise(2, 1)):
        assert abs(np.corrcoef(first, other)[0, 1]) < 0.05


def test_depth_may_be_taken_before_colour(perfect):
    options = SyntheticOptions.perfect(seed=1, frames=2, camera=SMALL, depth_delay=-0.2)
    source = SyntheticSource(options, perfect.scene)
    frame = source.frame(1)
    assert frame.depth_stamp - frame.stamp == -200_000_000
    earlier = SyntheticSource(dataclasses.replace(options, depth_delay=0.0), perfect.scene,
                              Later(source, -0.2)).frame(1)
    np.testing.assert_array_equal(frame.depth, earlier.depth)


class Later:
    """The path of a source, some time later [s]."""

    def __init__(self, source, delay):
        self.source, self.delay = source, delay

    def pose(self, time):
        return self.source.pose(1_000_000_000_000 + round(1e9 * (time + self.delay)))


@pytest.mark.parametrize('index', [-1, 3])
def test_a_frame_that_is_not_there_is_named(perfect, index):
    source = SyntheticSource(SyntheticOptions(seed=1, frames=3, camera=SMALL), perfect.scene)
    with pytest.raises(IndexError, match=f'frame {index} of 3'):
        source.frame(index)
    assert source.name == 'synthetic room, seed 1'


@pytest.mark.parametrize('options, sentence', [
    ({'frames': 0}, 'seed 0 and 0 frames: the seed must be 0 to 2^63 - 1, the frames 1 to 100000'),
    ({'seed': 2 ** 63}, 'seed 9223372036854775808 and 150 frames: the seed must be 0 to 2^63 - 1, '
     'the frames 1 to 100000'),
    ({'depth_delay': float('-inf')}, 'the depth delay is -inf s: it must be finite'),
    ({'camera': Camera(64, 48, 50, 50, 32, 24, 'plumb_bob', (0.1, 0, 0, 0))},
     'the camera has distortion: synthetic sequences are rendered without; leave the coefficients '
     'out')])
def test_the_sentence_says_what_an_option_must_be(options, sentence):
    with pytest.raises(InputError) as raised:
        SyntheticOptions(**options)
    assert str(raised.value) == sentence


def test_the_ends_of_the_ranges_are_within():
    for options in ({'frames': 1}, {'frames': 100_000}, {'seed': 2 ** 63 - 1}, {'rate': 0.01},
                    {'rate': 1000.0}):
        SyntheticOptions(**options)
    with pytest.raises(InputError, match='the frames 1 to 100000'):
        SyntheticOptions(frames=100_001)


@pytest.mark.parametrize('delay', [0.25, -0.25])
def test_colour_does_not_depend_on_when_depth_is_taken(perfect, delay):
    """Neither its blur, which needs a depth, nor its exposure, nor its noise."""
    options = SyntheticOptions(seed=1, frames=2, camera=SMALL, colour=ColourSensor(shutter=0.04))
    now, then = (SyntheticSource(dataclasses.replace(options, depth_delay=seconds), perfect.scene)
                 for seconds in (0.0, delay))
    np.testing.assert_array_equal(now.frame(1).colour, then.frame(1).colour)
    assert (now.frame(1).depth != then.frame(1).depth).mean() > 0.5
