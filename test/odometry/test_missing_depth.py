# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A rendered room whose depth is missing for a while: colour carries on, by the exact path."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry import Odometry
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

COUNT, MISSING = 20, range(5, 15)


@pytest.fixture(scope='module')
def rendered():
    source = SyntheticSource(SyntheticOptions(seed=5, frames=COUNT))
    return [source.frame(i) for i in range(COUNT)], source.pose


def without_depth(frame):
    return dataclasses.replace(frame, depth=np.full_like(frame.depth, np.nan))


def updates_of(frames, missing, settings=Settings()):
    odometry = Odometry(settings)
    return [odometry.register_frame(without_depth(frame) if i in missing else frame)
            for i, frame in enumerate(frames)]


@pytest.fixture(scope='module')
def blind(rendered):
    """Return the updates of the frames, of which some have no depth."""
    return updates_of(rendered[0], MISSING)


def test_without_depth_colour_carries_on(exact, rendered, blind):
    assert all(update.status.ok for update in blind)
    for i, update in enumerate(blind[1:], 1):
        assert update.evidence is (Evidence.COLOUR_ALONE if i in MISSING else Evidence.KEYPOINTS)
        translation, rotation = exact.error(update, *rendered)
        assert translation < 0.003 and rotation < np.radians(0.1)
    assert all('by colour alone' in blind[i].reason for i in MISSING)


def test_increments_without_depth_are_between_neighbours_and_honest(exact, rendered, blind):
    assert 0.3 < exact.nees(blind, MISSING, *rendered) < 9


def test_a_frame_without_depth_becomes_no_keyframe(rendered, blind):
    missing = {rendered[0][i].stamp for i in MISSING}
    assert missing.isdisjoint(update.reference.stamp for update in blind[1:])


def test_every_second_frame_may_have_no_depth(exact, rendered):
    updates = updates_of(rendered[0], range(1, COUNT, 2))
    assert all(update.status.ok for update in updates[2:])
    assert max(exact.error(update, *rendered)[0] for update in updates[2:]) < 0.003


def test_the_first_frame_may_be_the_only_one_with_depth(exact, rendered):
    """A camera that moves is found by the second one: by the first it has moved too suddenly."""
    updates = updates_of(rendered[0], range(1, COUNT))
    assert all(update.status.ok for update in updates[2:])
    assert max(exact.error(update, *rendered)[0] for update in updates[2:]) < 0.003


@pytest.mark.parametrize('name, value', [('refinement.mode', 'keypoints'),
                                         ('odometry.aick_interval', 4)])
def test_also_with_other_settings(exact, rendered, name, value):
    updates = updates_of(rendered[0], MISSING, with_values(Settings(), {name: value}))
    assert {updates[i].evidence for i in MISSING} == {Evidence.COLOUR_ALONE}
    assert max(exact.error(update, *rendered)[0] for update in updates) < 0.006


def test_it_is_known_whether_the_frame_before_was_tracked(rendered, monkeypatch):
    """By colour alone; two frames are dark."""
    followed, original = [], Registrar.register_colour
    monkeypatch.setattr(Registrar, 'register_colour', lambda *given: (
        followed.append(given[-1]) or original(*given)))
    frames = [dataclasses.replace(frame, colour=np.zeros_like(frame.colour))
              if i in (7, 8) else frame for i, frame in enumerate(rendered[0])]
    updates_of(frames[:11], MISSING)
    assert followed == [True, True, True, False, False, True]


@pytest.mark.parametrize('missing', [range(5, 20), range(0)])
def test_after_colour_alone_the_filtered_velocity_is_held(rendered, missing):
    """By colour alone an increment has more noise; after others it is held as it was."""
    odometry = Odometry()
    *_, before = (odometry.register_frame(without_depth(frame) if i in missing else frame)
                  for i, frame in enumerate(rendered[0][:10]))
    dark = dataclasses.replace(rendered[0][10], depth=np.full_like(rendered[0][10].depth, np.nan),
                               colour=np.zeros_like(rendered[0][10].colour))
    filtered, measured = before.prepared.twist, before.increment.twist
    assert np.abs(filtered - measured)[:3].max() > 0.002
    assert not odometry.register_frame(dark).status.ok
    last = odometry._references.last
    moved = se3.inverse(last.pose.matrix) @ odometry._path._pose.matrix
    elapsed = seconds(before.stamp, dark.stamp)
    np.testing.assert_allclose(se3.log(moved) / elapsed, filtered if missing else measured,
                               atol=1e-6)


def test_without_depth_and_light_the_camera_is_lost(rendered):
    frames = [dataclasses.replace(frame, colour=np.zeros_like(frame.colour))
              if i in MISSING else frame for i, frame in enumerate(rendered[0])]
    updates = updates_of(frames, MISSING)
    assert {updates[i].status for i in MISSING} == {Status.TOO_FEW_KEYPOINTS}
    assert all(update.status.ok for update in updates[MISSING.stop:])
