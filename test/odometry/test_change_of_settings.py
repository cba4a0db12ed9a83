# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Settings that change on the way, each with frames of the settings before."""

import dataclasses

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.registration.verified_aick import VerifiedAick
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CHANGES = [
    {}, {'refinement.mode': 'none'}, {'refinement.mode': 'keypoints'}, {},
    {'aick.vocabulary': 'orb-1000'}, {'refinement.mode': 'none'},
    {'refinement.surface_points': 100}, {'refinement.max_tracks': 50},
    {'features.max_keypoints': 150}, {'features.orb.patch_size': 21}, {},
    {'features.detector': 'sift'}, {'features.detector': 'surf'}, {'features.orb.levels': 3},
    {'sensor.min_depth': 0.5}, {},
    {'odometry.max_keyframes': 0}, {'odometry.reference': 'previous'}, {},
]


def test_no_change_loses_the_pose():
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=len(CHANGES)))
    odometry = Odometry()
    for i, changed in enumerate(CHANGES):
        odometry.change_settings(with_values(Settings(), changed))
        update = odometry.register_frame(source.frame(i))
        assert update.status is (Status.OK if i else Status.FIRST_FRAME), changed
        truth = se3.inverse(source.ground_truth.poses[0]) @ source.ground_truth.poses[i]
        apart = se3.inverse(truth) @ update.T_odom_camera
        assert np.linalg.norm(apart[:3, 3]) < 0.01, changed


def test_settings_that_cannot_be_taken_change_nothing(tmp_path):
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=2))
    odometry = Odometry()
    odometry.register_frame(source.frame(0))
    missing = {'features.detector': 'sift', 'aick.vocabulary': str(tmp_path / 'none.npz')}
    with pytest.raises(InputError, match='none.npz'):
        odometry.change_settings(with_values(Settings(), missing))
    assert odometry.register_frame(source.frame(1)).status is Status.OK


def test_what_was_learnt_of_the_camera_survives():
    """Stamps that jitter make the increments less sure, with other settings, too."""
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=24))
    rng = np.random.default_rng(0)
    frames = [source.frame(i) for i in range(24)]
    frames = [dataclasses.replace(f, stamp=f.stamp + int(rng.normal(0, 2e6))) for f in frames]
    odometry = Odometry()
    for frame in frames[:-1]:
        odometry.register_frame(frame)
    before = odometry.register_frame(frames[-1]).prepared.stamp_jitter
    odometry.change_settings(with_values(Settings(), {'aick.iterations': 12}))
    late = dataclasses.replace(frames[-1], stamp=frames[-1].stamp + 33_000_000)
    after = odometry.register_frame(late).prepared.stamp_jitter
    assert before > 0.001
    assert after == pytest.approx(before, rel=0.3)


@pytest.mark.parametrize('aick_interval', [1, 10])
@pytest.mark.parametrize('changed', [
    {'features.orb.patch_size': 21}, {'features.detector': 'sift'},
    {'features.orb.levels': 3, 'features.orb.scale_factor': 1.7}])
def test_a_kept_frame_is_prepared_again_once(changed, aick_interval, monkeypatch):
    """So that the fast schedule finds the pose, in keypoints that are of one kind."""
    monkeypatch.setattr(VerifiedAick, '_align_slowly', None)
    monkeypatch.setattr(VerifiedAick, '_refine_guess', None)
    extracted = []
    extract = KeypointExtractor.extract
    monkeypatch.setattr(KeypointExtractor, 'extract', lambda self, frame: (
        extracted.append(frame.stamp) or extract(self, frame)))
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=5))
    before = with_values(Settings(), {'odometry.aick_interval': aick_interval})
    odometry = Odometry(before)
    for i in (0, 1):
        odometry.register_frame(source.frame(i))
    odometry.change_settings(with_values(before, changed))
    extracted.clear()
    for i in (2, 3, 4):
        update = odometry.register_frame(source.frame(i))
        assert update.status is Status.OK and not update.recovered
        truth = se3.inverse(source.ground_truth.poses[0]) @ source.ground_truth.poses[i]
        apart = se3.inverse(truth) @ update.T_odom_camera
        assert np.linalg.norm(apart[:3, 3]) < 0.01
        rows, columns = update.matches.T
        assert len(rows) > 50 and rows.max() < len(update.keypoints)
        assert columns.max() < len(update.reference)
        assert update.reference.descriptors.shape[1] == update.keypoints.descriptors.shape[1]
    assert len(extracted) == len(set(extracted)) and source.frame(0).stamp in extracted


@pytest.mark.parametrize('changed', [
    {'features.orb.patch_size': 21}, {'aick.word_radius': 0.2}, {'refinement.mode': 'keypoints'}])
def test_a_change_in_the_dark_costs_the_next_frame_alone(changed, monkeypatch):
    made, extract, of = [], KeypointExtractor.extract, Surface.of
    monkeypatch.setattr(KeypointExtractor, 'extract', lambda self, frame: (
        made.append(frame.stamp) or extract(self, frame)))
    monkeypatch.setattr(Surface, 'of', lambda *arguments: made.append('surface') or of(*arguments))
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=11))
    odometry, rows = Odometry(with_values(Settings(), changed)), []
    for i in range(11):
        frame = source.frame(i)
        if i > 2:
            frame = dataclasses.replace(frame, colour=np.zeros_like(frame.colour))
        if i == 6:
            odometry.change_settings(Settings())
        made.clear()
        assert odometry.register_frame(frame).status.ok or i < 6
        rows.append(made.copy())
    for i, row in enumerate(rows[7:], 7):  # keypoints and surfaces of its own
        assert set(row) == {source.frame(i).stamp, 'surface'} and row.count('surface') == 3


def test_after_a_change_of_the_detector_a_late_frame_is_still_late():
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=3))
    odometry = Odometry()
    for i in (0, 1):
        odometry.register_frame(source.frame(i))
    odometry.change_settings(with_values(Settings(), {'features.detector': 'sift'}))
    assert odometry.register_frame(source.frame(0)).status is Status.BAD_STAMP
    assert odometry.register_frame(source.frame(2)).status is Status.OK
