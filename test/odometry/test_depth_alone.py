# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A rendered room in which the light goes out: depth carries on, against the exact path."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

COUNT, DARK = 18, range(4, 14)


@pytest.fixture(scope='module')
def rendered():
    source = SyntheticSource(SyntheticOptions(seed=5, frames=COUNT))
    return [source.frame(i) for i in range(COUNT)], source.pose


@pytest.fixture(scope='module')
def dark(rendered):
    """Return the updates of the frames, of which some are dark."""
    odometry = Odometry()
    return [odometry.register_frame(without_light(frame) if i in DARK else frame)
            for i, frame in enumerate(rendered[0])]


def without_light(frame):
    return dataclasses.replace(frame, colour=np.zeros_like(frame.colour))


def after_a_second(frame):
    depth_stamp = frame.depth_stamp and frame.depth_stamp + NANOSECONDS
    return dataclasses.replace(frame, stamp=frame.stamp + NANOSECONDS, depth_stamp=depth_stamp)


def test_in_the_dark_depth_carries_on(exact, rendered, dark):
    assert all(update.status.ok for update in dark)
    assert {dark[i].evidence for i in DARK} == {Evidence.DEPTH_ALONE}
    assert {dark[i].evidence for i in range(1, COUNT) if i not in DARK} == {Evidence.KEYPOINTS}
    for update in dark:
        translation, rotation = exact.error(update, *rendered)
        assert translation < 0.006
        assert rotation < np.radians(0.2)


def test_in_the_dark_increments_are_between_neighbours_and_honest(exact, rendered, dark):
    assert exact.nees(dark, DARK, *rendered) < 8


def test_a_dark_frame_becomes_no_keyframe(rendered, dark):
    keypoints = {i: dark[i].reference.stamp for i in range(1, COUNT) if i not in DARK}
    assert set(keypoints.values()).isdisjoint({rendered[0][i].stamp for i in DARK})


@pytest.mark.parametrize('lit', [range(COUNT, COUNT), range(6, COUNT), range(0, 1)],
                         ids=['never lit', 'lit later', 'lit at first'])
def test_a_camera_may_start_in_the_dark(exact, rendered, lit):
    """Also where it gets dark with the second frame, whose motion nothing lets expect."""
    frames, _ = rendered
    odometry = Odometry()
    updates = [odometry.register_frame(frame if i in lit else without_light(frame))
               for i, frame in enumerate(frames)]
    assert updates[0].status is Status.FIRST_FRAME
    assert all(update.status is Status.OK for update in updates[1:])
    assert ('by depth alone' in updates[0].reason) == (0 not in lit)
    by_keypoints = {i for i in range(COUNT) if updates[i].evidence is Evidence.KEYPOINTS}
    assert by_keypoints == set(lit[1:])  # to a frame with keypoints
    assert max(exact.error(update, *rendered)[0] for update in updates) < 0.005


@pytest.mark.parametrize('is_lit', [False, True])
def test_after_a_loss_in_the_dark_depth_carries_on_from_there(rendered, is_lit):
    """A second without any image: the motion meanwhile is not known, those after it are."""
    frames, pose = rendered
    dark = list(map(without_light, frames))
    later = [after_a_second(frame) for frame in dark[8:]]
    odometry = Odometry()
    updates = [odometry.register_frame(frame) for frame in [
        *(frames if is_lit else dark)[:4], *later]]
    assert [u.status.is_lost for u in updates] == [False] * 4 + [True] + [False] * 9
    assert {u.evidence for u in updates[5:]} == {Evidence.DEPTH_ALONE}
    assert np.sqrt(updates[-1].pose.covariance[0, 0]) > 0.3  # the second is not known
    motion = se3.inverse(updates[4].T_odom_camera) @ updates[-1].T_odom_camera
    true = se3.inverse(pose(frames[8].stamp)) @ pose(frames[-1].stamp)
    assert np.linalg.norm(motion[:3, 3] - true[:3, 3]) < 0.005
    found = odometry.register_frame(after_a_second(after_a_second(frames[4])))
    assert (found.evidence is Evidence.KEYPOINTS) == is_lit  # where the light went out


@pytest.mark.parametrize('share', [0.0, 0.01])
def test_without_keypoints_and_with_little_depth_nothing_begins(rendered, share):
    frame = without_light(rendered[0][0])
    columns = round(share * frame.depth.shape[1])
    depth = np.full_like(frame.depth, np.nan)
    depth[:, :columns] = frame.depth[:, :columns]
    update = Odometry().register_frame(dataclasses.replace(frame, depth=depth))
    assert update.status is Status.TOO_FEW_KEYPOINTS
    assert update.reason.startswith('0 keypoints with depth, at least 12 are required')


def test_at_the_start_in_the_dark_depth_of_other_times_is_brought_to_those_of_colour(
        exact, rendered):
    """Depth images before and after their colour images, while the velocity is not known."""
    frames, pose = rendered
    shown = []
    for i, lag in enumerate((-0.012, 0.012)):
        source = SyntheticSource(SyntheticOptions(seed=5, frames=COUNT, depth_delay=lag))
        shown.append(dataclasses.replace(
            without_light(frames[i]), depth=source.frame(i).depth,
            depth_stamp=frames[i].stamp + round(lag * NANOSECONDS)))
    odometry = Odometry()
    update = [odometry.register_frame(frame) for frame in shown][1]
    assert exact.error(update, frames, pose)[0] < 0.002


def test_depth_of_another_place_is_not_taken_for_the_same(rendered):
    frames, _ = rendered
    elsewhere = SyntheticSource(SyntheticOptions(seed=6, frames=1)).frame(0)
    odometry = Odometry()
    for frame in frames[:3]:
        odometry.register_frame(frame)
    update = odometry.register_frame(without_light(
        dataclasses.replace(frames[3], depth=elsewhere.depth)))
    assert update.status is Status.TOO_FEW_KEYPOINTS


def test_where_only_the_colour_image_repeats_depth_tells_the_motion(exact, rendered):
    frames, pose = rendered
    odometry = Odometry()
    updates = [odometry.register_frame(frame if i != 4 else dataclasses.replace(
        frame, colour=frames[3].colour)) for i, frame in enumerate(frames[:6])]
    assert updates[4].prepared.repeat is Repeat.COLOUR
    assert updates[4].evidence is Evidence.DEPTH_ALONE
    assert exact.error(updates[4], frames, pose)[0] < 0.003
    assert updates[5].evidence is Evidence.KEYPOINTS


def test_a_colour_image_that_repeats_without_depth_is_no_measurement(rendered):
    frames, _ = rendered
    odometry = Odometry()
    for frame in frames[:3]:
        odometry.register_frame(frame)
    blind = dataclasses.replace(frames[3], colour=frames[2].colour,
                                depth=np.full_like(frames[3].depth, np.nan))
    update = odometry.register_frame(blind)
    assert update.status is Status.REPEATED
    assert update.increment is None
    assert update.expected.interval == pytest.approx(1 / 30)
