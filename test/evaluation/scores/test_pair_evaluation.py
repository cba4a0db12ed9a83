# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Success ratios against the rules written down again, slowly, with scipy's rotations."""

import gc
import statistics
import weakref
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from aick_ros.evaluation.scores import pair_evaluation
from aick_ros.evaluation.scores.pair_evaluation import (
    THRESHOLDS, PairError, PairEvaluation, PairScore)
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Registration
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset
from aick_ros.sources import open_source, raise_damage

GAPS = (1, 3, 5)
PERIOD = NANOSECONDS // 30


class Guess:
    """Stands in for a registrar: answers each pair with a pose of its own, or with a failure."""

    def __init__(self):
        self.answers = {}

    def register(self, source, target):
        rng = np.random.default_rng([source.stamp, target.stamp])
        failed = rng.random() < 0.15
        pose = se3.exp(rng.normal(0, 0.01, 6))
        self.answers[target.stamp, source.stamp] = None if failed else pose
        return Registration(Status.TOO_FEW_MATCHES if failed else Status.OK, '',
                            np.eye(4) if failed else pose, np.eye(6), np.empty((0, 2), int), 1)


def view(stamp):
    frame = RgbdFrame(int(stamp), np.zeros((3, 4), np.uint8), np.ones((3, 4), np.float32),
                      Camera(4, 3, 4.0, 4.0, 1.5, 1.0))
    keypoints = KeypointFrame(int(stamp), np.empty((0, 3)), np.empty((0, 32), np.uint8),
                              np.empty((0, 3, 3)), np.empty((0, 2)))
    return PreparedFrame(frame, keypoints, frame.grey)


@pytest.fixture
def evaluation_by(monkeypatch):
    """Return a function that makes a PairEvaluation whose registrar is a stand-in."""
    def make(registrar, ground_truth, gaps):
        monkeypatch.setattr('aick_ros.evaluation.scores.pair_evaluation.Registrar',
                            lambda settings: registrar)
        return PairEvaluation(Settings(), ground_truth, gaps)
    return make


@pytest.fixture
def stamps():
    """Return 60 stamps of a camera that trembles, with two frames missing and one pause."""
    rng = np.random.default_rng(1)
    numbers = np.delete(np.arange(62), [20, 33])
    times = 5 * NANOSECONDS + numbers * PERIOD + rng.integers(-2_000_000, 2_000_000, 60)
    times[45:] += NANOSECONDS // 2
    return times


@pytest.fixture
def ground_truth(stamps):
    """Return a path at 100 Hz with two holes, which ends before the last frames."""
    times = np.arange(stamps[0] - 7_000_000, stamps[-4], 10_000_000)
    inside = np.ones(len(times), bool)
    inside[50:55] = False  # 60 ms
    inside[80:83] = False  # 40 ms, short enough
    rng = np.random.default_rng(2)
    steps = (se3.exp(rng.normal(0, 0.002, 6)) for _ in times)
    poses, pose = [], np.eye(4)
    for step in steps:
        pose = pose @ step
        poses.append(pose)
    return Trajectory(times[inside], np.array(poses)[inside])


@pytest.fixture
def run(evaluation_by):
    """Return a function from stamps to the scores of guesses, and to the guesses."""
    def score(stamps, ground_truth, gaps=GAPS):
        guess = Guess()
        pairs = evaluation_by(guess, ground_truth, gaps)
        for stamp in stamps:
            pairs.add(view(stamp))
        return pairs.scores(), guess.answers
    return score


def slow_truth(ground_truth, stamp):
    """Return position and Rotation at a stamp, None in a hole of more than 0.05 s."""
    before = [t for t in ground_truth.stamps if t <= stamp]
    after = [t for t in ground_truth.stamps if t >= stamp]
    if not before or not after or after[0] - before[-1] > 50_000_000:
        return None
    pair = [int(before[-1]), int(after[0])]
    poses = [ground_truth.poses[list(ground_truth.stamps).index(t)] for t in pair]
    if pair[0] == pair[1]:
        return poses[0][:3, 3], Rotation.from_matrix(poses[0][:3, :3])
    share = (int(stamp) - pair[0]) / (pair[1] - pair[0])
    turn = Slerp([0, 1], Rotation.from_matrix([pose[:3, :3] for pose in poses]))(share)
    return (1 - share) * poses[0][:3, 3] + share * poses[1][:3, 3], turn


def slow_errors(stamps, ground_truth, answers, gap):
    """Yield translation [m] and rotation [deg] of each pair; None where it failed."""
    period = statistics.median(b - a for a, b in zip(stamps, stamps[1:]))
    for target, source in zip(stamps, stamps[gap:]):
        if abs((source - target) - gap * period) > 0.02 * NANOSECONDS:
            continue
        truths = [slow_truth(ground_truth, stamp) for stamp in (target, source)]
        if None in truths:
            continue
        (target_position, target_turn), (source_position, source_turn) = truths
        answer = answers[target, source]
        if answer is None:
            yield None
            continue
        # the source's origin in the world, estimated and true
        position = target_position + target_turn.apply(answer[:3, 3])
        turn = target_turn * Rotation.from_matrix(answer[:3, :3])
        yield (np.linalg.norm(position - source_position),
               np.degrees((source_turn.inv() * turn).magnitude()))


@pytest.mark.parametrize('gap', GAPS)
def test_scores_follow_the_rules(run, stamps, ground_truth, gap):
    scores, answers = run(stamps, ground_truth)
    errors = list(slow_errors(stamps, ground_truth, answers, gap))
    translations = [np.inf if error is None else error[0] for error in errors]
    rotations = [np.inf if error is None else error[1] for error in errors]
    score = scores[gap]
    # the scene has all that the rules speak of
    assert 0 < len(errors) < len(stamps) - gap
    assert errors.count(None) > 0
    assert score.count == len(errors)
    assert score.failed == errors.count(None)
    assert list(score.success_ratio) == ['0.0033', '0.01', '0.05']
    for threshold, ratio in score.success_ratio.items():
        assert ratio == pytest.approx(
            sum(t < float(threshold) for t in translations) / len(translations))
    assert score.translation_median_m == pytest.approx(statistics.median(translations))
    assert score.rotation_median_deg == pytest.approx(statistics.median(rotations))
    assert 0 < score.registration_ms.p50 <= score.registration_ms.p99


def test_a_right_answer_has_no_error(evaluation_by, stamps, ground_truth):
    class Truth:
        def register(self, source, target):
            poses = [ground_truth.at(frame.stamp) for frame in (target, source)]
            return Registration(Status.OK, '', np.linalg.inv(poses[0]) @ poses[1], np.eye(6),
                                np.empty((0, 2), int), 1)

    pairs = evaluation_by(Truth(), ground_truth, [2])
    for stamp in stamps:
        pairs.add(view(stamp))
    score = pairs.scores()[2]
    assert score.success_ratio == {'0.0033': 1.0, '0.01': 1.0, '0.05': 1.0}
    assert score.translation_median_m < 1e-12


def test_each_gap_has_a_registrar_of_its_own(monkeypatch, stamps, ground_truth):
    """A registrar learns from the motions it sees, so one must not see those of two gaps."""
    gaps_seen = []

    class Watched(Guess):
        def __init__(self, settings):
            super().__init__()
            self.gaps = set()
            gaps_seen.append(self.gaps)

        def register(self, source, target):
            numbers = [list(stamps).index(frame.stamp) for frame in (target, source)]
            self.gaps.add(numbers[1] - numbers[0])
            return super().register(source, target)

    monkeypatch.setattr('aick_ros.evaluation.scores.pair_evaluation.Registrar', Watched)
    pairs = PairEvaluation(Settings(), ground_truth, GAPS)
    for stamp in stamps:
        pairs.add(view(stamp))
    assert sorted(map(sorted, gaps_seen)) == [[gap] for gap in GAPS]


def test_a_success_is_an_error_below_the_threshold():
    score = PairScore.of([PairError(threshold, 0.0, 1.0) for threshold in THRESHOLDS])
    assert list(score.success_ratio.values()) == pytest.approx([0.0, 1 / 3, 2 / 3])


@pytest.mark.parametrize('count', [0, 1, 3])
def test_too_few_frames_for_a_pair(run, stamps, ground_truth, count):
    score = run(stamps[:count], ground_truth, [3])[0][3]
    assert (score.count, score.failed) == (0, 0)
    assert set(score.success_ratio.values()) == {None}
    assert score.translation_median_m is None


def test_memory_does_not_grow_with_the_recording(evaluation_by, stamps, ground_truth):
    pairs = evaluation_by(Guess(), ground_truth, GAPS)
    seen = []
    for stamp in stamps:
        frame = view(stamp)
        seen.append(weakref.ref(frame))
        pairs.add(frame)
    del frame
    gc.collect()
    assert sum(frame() is not None for frame in seen) == max(GAPS) + 1


@pytest.mark.parametrize('name', ['freiburg1_xyz_150', 'freiburg1_rpy_100'])
def test_the_papers_accuracy_on_a_real_camera(tum_folder, name):
    source = open_source(tum_folder(name))
    full = preset('paper-full')
    short = with_values(full, {'aick.alpha': 0.6, 'aick.iterations': 10})
    registrar = Registrar(full)
    near = PairEvaluation(full, source.ground_truth, [1])
    far = PairEvaluation(short, source.ground_truth, [5])
    for frame in source.frames(raise_damage):
        seen = registrar.prepare(frame)
        near.add(seen)
        far.add(seen)
    assert near.scores()[1].success_ratio['0.01'] >= 0.84
    assert near.scores()[1].success_ratio['0.05'] >= 0.99
    assert far.scores()[5].success_ratio['0.01'] >= 0.28


@pytest.mark.parametrize('status', [Status.OK, Status.TOO_FEW_MATCHES])
def test_registrations_are_timed_in_milliseconds_whether_they_succeed_or_not(
        monkeypatch, status):
    now = [100.0]

    def register(source, target):
        now[0] += 0.25
        return SimpleNamespace(status=status, T_target_source=np.eye(4), covariance=np.eye(6))
    monkeypatch.setattr(pair_evaluation.time, 'perf_counter', lambda: now[0])
    error = pair_evaluation._measure(SimpleNamespace(register=register), None, None, np.eye(4))
    assert error.milliseconds == 250.0
    assert error.failed is not status.ok
