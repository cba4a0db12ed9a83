# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The end of a fleet names what failed, what tracked nothing, and what was not used."""

from pathlib import Path

import pytest

from aick_ros.cli.fleet.summary import is_tracked, show_summary
from aick_ros.evaluation.runs.table import DONE, FAILED

TRACKED = {'source': 'desk', 'variant': 'defaults', 'status': DONE, 'run': 'runs/desk',
           'tracked': 9}
DARK = {**TRACKED, 'source': 'dark', 'run': 'runs/dark', 'tracked': 0}
BROKEN = {**TRACKED, 'status': FAILED, 'cause': 'input', 'reason': 'no depth.txt'}


@pytest.mark.parametrize('row, tracked', [(TRACKED, True), (DARK, False), (BROKEN, False)])
def test_a_run_is_tracked_where_it_ended_with_a_tracked_frame(row, tracked):
    assert is_tracked(row) is tracked


def test_what_failed_and_what_was_not_tracked_is_named(capfd):
    show_summary([TRACKED, DARK, BROKEN], Path('out'), on_stderr=False)
    assert capfd.readouterr().err == (
        'aick: desk (defaults): input: no depth.txt\n'
        'aick: 1 of 3 runs failed: out/table.parquet has the reasons\n'
        'aick: dark (defaults): no frame was tracked: out/runs/dark has the reasons\n'
        'aick: in 1 of 3 runs no frame was tracked\n'
        'aick: details: out/report.html\n')


def test_sensors_that_were_not_used_are_named(capfd):
    show_summary([{**TRACKED, 'unused_sensors': ''}, {**TRACKED, 'unused_sensors': 'it hangs'},
                  BROKEN], Path('out'), on_stderr=False)
    assert capfd.readouterr().err.splitlines()[2:] == [
        'aick: desk (defaults): it hangs',
        'aick: in 1 of 3 runs a sensor was not used: out/table.parquet has the reasons',
        'aick: details: out/report.html']


def test_remarks_on_recordings_are_shown(capfd):
    show_summary([{**TRACKED, 'remarks': ''}, {**TRACKED, 'remarks': '2 images skipped'},
                  *6 * [{**DARK, 'tracked': 9, 'remarks': 'another clock'}]], Path('out'),
                 on_stderr=False)
    assert capfd.readouterr().err.splitlines() == [
        'aick: desk (defaults): 2 images skipped', *4 * ['aick: dark (defaults): another clock'],
        'aick: in 7 of 8 runs something is wrong with the recording: out/table.parquet has the '
        'reasons', 'aick: details: out/report.html']


def test_no_more_than_five_runs_are_named(capfd):
    show_summary(9 * [DARK], Path('out'), on_stderr=False)
    assert capfd.readouterr().err.count('aick: dark') == 5


def test_runs_are_named_whose_ground_truth_does_not_cover_all_frames(capfd):
    covered = 'trajectory.covered_frames'
    show_summary([{**TRACKED, 'frames': 144, covered: 144}, {**TRACKED, 'frames': 144, covered: 6},
                  {**TRACKED, 'frames': 144, covered: None}, {**TRACKED, 'frames': 144}],
                 Path('out'), on_stderr=False)
    assert capfd.readouterr().err == (
        'aick: desk (defaults): 6 of 144 frames have ground truth: errors are of these alone\n'
        'aick: in 1 of 4 runs the ground truth does not cover all frames: out/table.parquet has '
        'their number (trajectory.covered_frames)\n'
        'aick: details: out/report.html\n')
