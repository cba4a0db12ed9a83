# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The figures of a recording against the same figures made slowly, and their form."""

import dataclasses
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from aick_ros.errors import InputError
from aick_ros.evaluation.scores.evaluation import evaluate
from aick_ros.frames.imu import ImuSamples
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.registration.aick.aick import Aick
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FRAMES = 20
RATE = 15.0  # so that there are frames 1 s apart
GAPS = (1, 5)
SETTINGS = preset('paper-fast')


class InMemory:
    """A rendered recording, kept, so that it is rendered once."""

    def __init__(self, rendered, ground_truth):
        self.name, self.ground_truth, self._frames = 'rendered', ground_truth, rendered

    def __len__(self):
        return len(self._frames)

    def frames(self, on_damaged):
        on_damaged(InputError('frame 3 is torn'))
        yield from self._frames


def ignore(error):
    """Take no notice of damage."""


@pytest.fixture(scope='module')
def source():
    camera = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    rendered = SyntheticSource(SyntheticOptions(seed=3, frames=FRAMES, rate=RATE,
                                                camera=camera))
    return InMemory(list(rendered.frames(ignore)), rendered.ground_truth)


@pytest.fixture(scope='module')
def evaluation(source):
    return evaluate(source, SETTINGS, GAPS, on_damaged=ignore)


def test_it_begins_level_by_all_that_was_measured_meanwhile(source):
    """The camera is pushed before the first frame alone, and is level by what follows."""
    def forces(frame, index):
        stamps = frame.stamp - np.arange(20, dtype=np.int64)[::-1] * 5_000_000
        measured = np.tile([0.0, -9.8, 0.0] if index else [3.0, -9.8, 0.0], (20, 1))
        measured[:, 2] += 0.01 * np.arange(20)
        return dataclasses.replace(frame, imu=ImuSamples(
            stamps, np.full((20, 3), np.nan), measured))

    frames = [forces(frame, index) for index, frame in enumerate(source.frames(ignore))][:5]
    settings = with_values(SETTINGS, {'imu.level_sigma': 1.0})
    records = evaluate(InMemory(frames, source.ground_truth), settings, GAPS,
                       on_damaged=ignore).records
    as_it_began = Odometry(settings).register_frame(frames[0])
    right = [record.T_odom_camera[2, 0] for record in (as_it_began, records[0])]
    assert abs(right[0]) > 0.25  # of the camera's x axis, which is level
    assert abs(right[1]) < abs(right[0]) / 2
    assert [record.stamp for record in records] == [frame.stamp for frame in frames]


def shape(value):
    """Return the keys of nested objects, with the types of what is in them."""
    if isinstance(value, dict):
        return {key: shape(inner) for key, inner in value.items()}
    return 'number' if isinstance(value, (int, float)) else type(value).__name__


def test_json_has_the_promised_names(evaluation):
    figures = json.loads(json.dumps(evaluation.to_json(), allow_nan=False))
    times = {'p50': 'number', 'p99': 'number'}
    consistency = {'nees_mean': 'number', 'dof': 'number', 'inside_95': 'number',
                   'inside_997': 'number'}
    motion = {'count': 'number', **dict.fromkeys(('joint', 'translation', 'rotation'),
                                                 consistency)}
    pair = {'count': 'number', 'failed': 'number',
            'success_ratio': {'0.0033': 'number', '0.01': 'number', '0.05': 'number'},
            'translation_median_m': 'number', 'rotation_median_deg': 'number',
            'registration_ms': times, 'consistency': consistency}
    promised = {
        'source': 'str', 'frames': 'number', 'keypoints_mean': 'number',
        'pairs': {'1': pair, '5': pair},
        'trajectory': {'rpe_1s_translation_rmse_m': 'number',
                       'rpe_1s_rotation_rmse_deg': 'number', 'ate_rmse_m': 'number',
                       'tracked_fraction': 'number', 'covered_frames': 'number'},
        'consistency': consistency, 'pose_consistency': motion,
        'silent_failures': {'reported_good': 'number', 'reported_good_but_off': 'number',
                            'refused': 'number', 'refused_but_good': 'number'},
        'timing_ms': {'features': times, 'surface': times, 'registration': times,
                      'refinement': times, 'total': times}}
    found = shape(figures)
    assert {key: found[key] for key in promised} == promised
    assert set(figures['trajectory_consistency']) == {'1', '10', '30', '100'}
    assert shape(figures['trajectory_consistency']['10']) == motion
    assert figures['trajectory_consistency']['30']['count'] == 0
    assert figures['rest'] == {
        'stretches': 0, 'duration_s': 0.0, 'largest_translation_m': None,
        'largest_rotation_deg': None, 'translation_mm_per_min': None,
        'rotation_deg_per_min': None}
    assert figures['settings']['aick.iterations'] == 10
    assert figures['machine']['cores'] >= 1
    assert not {'nees', 'records'} & set(figures)


def test_pairs_agree_with_registrations_one_by_one(source, evaluation):
    truth = source.ground_truth.poses
    extractor = KeypointExtractor(SETTINGS.features, SETTINGS.sensor)
    frames = [extractor.extract(frame) for frame in source.frames(ignore)]
    assert evaluation.keypoints_mean == pytest.approx(np.mean([len(frame) for frame in frames]))
    for gap in GAPS:
        errors = []
        for i in range(FRAMES - gap):
            answer = Aick(SETTINGS.aick).register(frames[i + gap], frames[i])
            G = np.linalg.inv(truth[i]) @ truth[i + gap]
            E = np.linalg.inv(G) @ answer.T_target_source - np.eye(4)  # Eq. 3
            errors.append(np.sqrt(np.sum(E[:3, 3] ** 2)))  # Eq. 4
        score = evaluation.pairs[gap]
        assert score.count == FRAMES - gap
        assert score.translation_median_m == pytest.approx(np.median(errors), rel=1e-6)
        for threshold, ratio in score.success_ratio.items():
            assert ratio == pytest.approx(np.mean(np.array(errors) < float(threshold)))


def test_tracks_a_rendered_recording(evaluation):
    assert evaluation.frames == FRAMES
    assert evaluation.trajectory.tracked_fraction == 1.0
    assert evaluation.trajectory.ate_rmse_m < 0.02


def test_consistency_agrees_with_registrations_one_by_one(source, evaluation):
    truth = source.ground_truth.poses
    extractor = KeypointExtractor(SETTINGS.features, SETTINGS.sensor)
    frames = [extractor.extract(frame) for frame in source.frames(ignore)]
    for gap in GAPS:
        distances = []
        for i in range(FRAMES - gap):
            answer = Aick(SETTINGS.aick).register(frames[i + gap], frames[i])
            G, T = np.linalg.inv(truth[i]) @ truth[i + gap], answer.T_target_source
            turn = Rotation.from_matrix(T[:3, :3]) * Rotation.from_matrix(G[:3, :3]).inv()
            error = np.r_[T[:3, 3] - G[:3, 3], turn.as_rotvec()]
            distances.append(error @ np.linalg.inv(answer.covariance) @ error)
        score = evaluation.pairs[gap].consistency
        assert score.nees_mean == pytest.approx(np.mean(distances), rel=1e-4)
        assert score.inside_95 == pytest.approx(np.mean(chi2(6).cdf(distances) <= 0.95))
        assert score.inside_997 == pytest.approx(np.mean(chi2(6).cdf(distances) <= 0.997))


def test_good_registrations_outside_the_gate_count_as_rejected_good_ones(source):
    strict = with_values(SETTINGS, {'odometry.max_speed': 0.01})
    failures = evaluate(source, strict, [1], on_damaged=ignore).silent_failures
    assert failures.reported_good + failures.refused == FRAMES - 1
    assert failures.refused_but_good >= FRAMES // 2
    assert failures.reported_good_but_off == 0


def test_a_wrong_path_is_reported_good(source):
    """The camera jumps aside by 10 cm in the middle, and no image shows it."""
    poses = source.ground_truth.poses.copy()
    poses[FRAMES // 2:, :3, 3] += [0, 0, 0.1]
    odd = InMemory(list(source.frames(ignore)), Trajectory(source.ground_truth.stamps, poses))
    failures = evaluate(odd, SETTINGS, [1], on_damaged=ignore).silent_failures
    assert (failures.reported_good_but_off, failures.reported_good) == (1, FRAMES - 1)


def test_motions_of_one_frame_are_the_increments(evaluation):
    assert evaluation.trajectory_consistency[1].count == FRAMES - 1
    assert evaluation.trajectory_consistency[1].joint.nees_mean == pytest.approx(
        evaluation.consistency.nees_mean, rel=1e-4)


def test_progress_and_damage_are_reported(source):
    done, damaged = [], []
    evaluate(source, SETTINGS, [1], done.append, damaged.append)
    assert done == list(range(1, FRAMES + 1))
    assert [str(error) for error in damaged] == ['frame 3 is torn']
    with pytest.raises(InputError, match='torn'):
        evaluate(source, SETTINGS, [1])


def test_without_ground_truth_there_are_times_alone(source):
    blind = InMemory(list(source.frames(ignore))[:4], None)
    figures = evaluate(blind, SETTINGS, [1, 2], on_damaged=ignore).to_json()
    nothing = {'nees_mean': None, 'dof': 6, 'inside_95': None, 'inside_997': None}
    assert figures['pairs']['2'] == {
        'count': 0, 'failed': 0, 'success_ratio': {'0.0033': None, '0.01': None, '0.05': None},
        'translation_median_m': None, 'rotation_median_deg': None,
        'registration_ms': {'p50': None, 'p99': None}, 'consistency': nothing}
    assert figures['consistency'] == figures['pose_consistency']['joint'] == nothing
    assert figures['trajectory_consistency']['1']['count'] == 0
    assert set(figures['silent_failures'].values()) == {None}
    assert figures['trajectory'] == {
        'rpe_1s_translation_rmse_m': None, 'rpe_1s_rotation_rmse_deg': None, 'ate_rmse_m': None,
        'tracked_fraction': 1.0, 'covered_frames': None}
    assert figures['timing_ms']['features']['p50'] > 0


@pytest.mark.parametrize('gaps', [[], [0], [-1, 5]])
def test_invalid_gaps_are_rejected(source, gaps):
    with pytest.raises(InputError, match='gaps'):
        evaluate(source, SETTINGS, gaps)


def test_a_recording_without_frames_is_rejected(source):
    with pytest.raises(InputError, match='rendered has no usable frame'):
        evaluate(InMemory([], source.ground_truth), Settings(), on_damaged=ignore)
