# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The tables of an evaluation by scores made by hand."""

from types import SimpleNamespace

import pytest

from aick_ros.cli.output import evaluation_tables
from aick_ros.cli.output.evaluation_tables import show
from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.evaluation.scores.motion_consistency import MotionConsistency
from aick_ros.evaluation.scores.run_errors import SilentFailures


def namespace(**parts):
    return SimpleNamespace(**parts)


def consistency(first):
    return Consistency(first, 6, 0.01 * first, 0.02 * first)


def motions(count, first):
    return MotionConsistency(count, consistency(first), consistency(first + 1),
                             consistency(first + 2))


def pair_score(count, failed, first):
    return namespace(
        count=count, failed=failed, success_ratio={'0.0033': 0.25, '0.05': 0.75},
        translation_median_m=0.001 * first, rotation_median_deg=0.01 * first,
        registration_ms=namespace(p50=first + 0.5, p99=first + 0.75),
        consistency=consistency(first))


@pytest.fixture
def evaluation():
    return namespace(
        source='a room', frames=123, pairs={1: pair_score(40, 3, 11), 5: pair_score(30, 2, 21)},
        consistency=consistency(31), trajectory_consistency={10: motions(9, 41),
                                                             20: motions(0, 1)},
        pose_consistency=motions(8, 51), keypoints_mean=345.4,
        trajectory=namespace(rpe_1s_translation_rmse_m=0.01234, rpe_1s_rotation_rmse_deg=1.239,
                             ate_rmse_m=0.0567, tracked_fraction=0.987, covered_frames=123),
        rest=namespace(stretches=2, duration_s=12.3, largest_translation_m=0.0012,
                       largest_rotation_deg=0.034, translation_mm_per_min=5.64,
                       rotation_deg_per_min=0.789),
        silent_failures=SilentFailures(100, 4, 7, 5),
        timing_ms={'features': namespace(p50=4.04, p99=9.09),
                   'total': namespace(p50=14.14, p99=19.19)})


def shown(capsys, evaluation, on_stderr=False):
    """Return the cells of each line."""
    show(evaluation, on_stderr)
    output = capsys.readouterr()
    text, other = output if not on_stderr else output[::-1]
    assert other == ''
    return [line.split() for line in text.splitlines()]


def test_pairs_have_counts_ratios_medians_and_times(capsys, evaluation):
    lines = shown(capsys, evaluation)
    assert lines[0] == ['a', 'room:', '123', 'frames']
    assert '1 40 3 0.250 0.750 11.0 0.11 11.5 11.8'.split() in lines
    assert '5 30 2 0.250 0.750 21.0 0.21 21.5 21.8'.split() in lines
    assert any({'3.3', '50'} <= set(line) for line in lines)  # thresholds in mm


def headed(monkeypatch, evaluation):
    """Return title -> rows of each table, as head of the column -> cell."""
    tables = {}

    def keep(title, rows, columns=('name', 'value'), on_stderr=False):
        heads = [column.replace('\n', ' ') for column in columns]
        tables[title] = [dict(zip(heads, row, strict=True)) for row in rows]
    monkeypatch.setattr(evaluation_tables, 'table', keep)
    show(evaluation, False)
    return tables


def test_heads_name_what_is_in_a_column_and_its_unit(monkeypatch, evaluation):
    tables = headed(monkeypatch, evaluation)
    assert list(tables) == ['a room: 123 frames', 'covariances',
                            'covariances along the trajectory', '']
    assert tables['a room: 123 frames'][0] == {
        'gap': '1', 'pairs': '40', 'failed': '3', 'within 3.3 mm': '0.250',
        'within 50 mm': '0.750', 'median [mm]': '11.0', 'median [deg]': '0.11', 'p50 [ms]': '11.5',
        'p99 [ms]': '11.8'}
    assert tables['covariances'][0] == {
        '': 'odometry', 'mean NEES (correct: 6)': '31.0', 'inside 95 %': '0.310',
        'inside 99.7 %': '0.620'}
    evaluation.pairs[1].translation_median_m = None
    assert headed(monkeypatch, evaluation)['a room: 123 frames'][0]['median [mm]'] == '-'


def test_heads_of_motions_have_the_degrees_of_freedom_of_their_part(monkeypatch, evaluation):
    shown_ = []
    monkeypatch.setattr(evaluation_tables, 'table',
                        lambda title, rows, columns=(), on_stderr=False: shown_.append(columns))
    show(evaluation, False)
    assert [head.replace('\n', ' ') for head in shown_[2]] == [
        '', 'count', 'all six: NEES (6)', 'inside 95 %', 'translation: NEES (3)', 'inside 95 %',
        'rotation: NEES (3)', 'inside 95 %']


def test_covariances_are_those_of_the_odometry_and_of_each_gap(capsys, evaluation):
    lines = shown(capsys, evaluation)
    assert 'odometry 31.0 0.310 0.620'.split() in lines
    assert 'gap 1 11.0 0.110 0.220'.split() in lines
    assert 'gap 5 21.0 0.210 0.420'.split() in lines


def test_a_gap_without_a_pair_has_no_row(monkeypatch, evaluation):
    evaluation.pairs[1].count = 0
    tables = headed(monkeypatch, evaluation)
    assert [row['gap'] for row in tables['a room: 123 frames']] == ['5']
    assert [row[''] for row in tables['covariances']] == ['odometry', 'gap 5']


def test_along_the_trajectory_all_six_come_before_translation_and_rotation(capsys, evaluation):
    lines = shown(capsys, evaluation)
    assert '10 frames 9 41.0 0.410 42.0 0.420 43.0 0.430'.split() in lines
    assert 'poses 8 51.0 0.510 52.0 0.520 53.0 0.530'.split() in lines
    assert not any(line[:2] == ['20', 'frames'] for line in lines)


def test_errors_drift_and_times_have_their_units(capsys, evaluation):
    rows = [' '.join(line) for line in shown(capsys, evaluation)]
    assert {'RPE over 1 s, translation 0.0123 m', 'RPE over 1 s, rotation 1.24 deg',
            'ATE 0.0567 m', 'at rest for 12 s, largest drift 0.0012 m, 0.034 deg',
            'drift at rest 5.6 mm/min, 0.789 deg/min', 'tracked 0.987',
            'keypoints per frame 345', 'features, p50 / p99 4.0 / 9.1 ms',
            'total, p50 / p99 14.1 / 19.2 ms'} <= set(rows)


@pytest.mark.parametrize('covered, rows', [
    (None, []), (123, []), (122, ['122 of 123']), (0, ['0 of 123'])])
def test_frames_with_ground_truth_are_counted_where_they_are_not_all(
        capsys, evaluation, covered, rows):
    evaluation.trajectory.covered_frames = covered
    lines = [' '.join(line) for line in shown(capsys, evaluation)]
    found = [line.removeprefix('frames with ground truth ') for line in lines
             if line.startswith('frames with ground truth ')]
    assert found == rows


def test_wrong_decisions_are_counts_of_counts(capsys, evaluation):
    failures = evaluation.silent_failures
    rows = [' '.join(line) for line in shown(capsys, evaluation)]
    assert (f'accepted, but error above 5 cm or 3 deg {failures.reported_good_but_off} of '
            f'{failures.reported_good}') in rows
    assert (f'rejected, but within both {failures.refused_but_good} of '
            f'{failures.refused}') in rows


def test_without_truth_there_are_dashes_and_no_rows_of_it(capsys, evaluation):
    evaluation.trajectory = namespace(**dict.fromkeys(vars(evaluation.trajectory)))
    evaluation.silent_failures = SilentFailures(None, None, None, None)
    evaluation.rest.stretches = 0
    evaluation.trajectory_consistency, evaluation.pose_consistency = {}, motions(0, 1)
    rows = [' '.join(line) for line in shown(capsys, evaluation, on_stderr=True)]
    assert {'ATE -', 'RPE over 1 s, translation -', 'tracked -'} <= set(rows)
    assert not any(word in row for row in rows for word in ('rest', 'accepted', 'along'))
