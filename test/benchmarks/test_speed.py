# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Ratios of measured times, and what counts as having become worse."""

import json
import time
from pathlib import Path

import pytest

from aick_ros.geometry.camera import Camera
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FOLDER = Path(__file__).parents[2] / 'benchmarks'
TIMES = {
    'default': {'total': [8.0, 12.0, 10.0]},
    'opencv-depth': {'total': [40.0, 60.0]},
    'small-gicp': {'total': [500.0], 'prepare': [400.0], 'register': [100.0]},
    'aick-orb-fast': {'total': [14.0], 'prepare': [12.0], 'register': [2.0]},
}


@pytest.fixture(scope='module')
def speed_ratios(load):
    return load(FOLDER / 'speed_ratios.py')


@pytest.fixture(scope='module')
def release_history(load):
    return load(FOLDER / 'release_history.py')


def test_ratios_are_of_mean_times(speed_ratios):
    found = speed_ratios.ratios(TIMES)
    assert found['default_by_opencv_depth'] == pytest.approx(10.0 / 50.0)
    assert found['small_gicp_by_orb_fast'] == pytest.approx(50.0)  # registrations alone
    assert found['default_by_small_gicp'] == pytest.approx(10.0 / 500.0)
    assert found['p99_by_median'] == pytest.approx(1.196)


def test_what_did_not_take_part_has_no_ratio(speed_ratios):
    assert not any('embedded' in name or 'pnp' in name for name in speed_ratios.ratios(TIMES))


def test_the_noise_is_how_far_runs_are_apart(release_history):
    found = release_history.summary([{'a': 0.2}, {'a': 0.5}, {'a': 0.3}])
    assert found['a'].value == 0.3
    assert found['a'].noise == pytest.approx(0.3)


@pytest.mark.parametrize(('name', 'then', 'now', 'is_worse'), [
    ('default_by_pnp', 0.50, 0.56, True),
    ('default_by_pnp', 0.50, 0.54, False),  # within both noises together
    ('default_by_pnp', 0.50, 0.40, False),
    ('small_gicp_by_orb', 0.50, 0.40, True),  # here larger is better
    ('small_gicp_by_orb', 0.50, 0.60, False),
])
def test_worse_is_what_the_noise_does_not_explain(
        speed_ratios, release_history, name, then, now, is_worse):
    figure = release_history.Figure
    found = release_history.worse({name: figure(now, 0.03), 'new': figure(1.0, 0.0)},
                                  {name: figure(then, 0.02), 'gone': figure(1.0, 0.0)},
                                  speed_ratios.LARGER_IS_BETTER)
    assert [line.split()[0] for line in found] == ([name] if is_worse else [])


def test_a_release_is_compared_with_the_last_one_of_the_same_processor(release_history):
    last_release = release_history.last_release
    history = [{'release': str(number), 'machine': {'cpu': cpu}}
               for number, cpu in enumerate(('a', 'b', 'a', 'b'))]
    assert last_release(history, 'a')['release'] == '2'
    assert last_release(history, 'c')['release'] == '3'
    assert last_release([], 'c') is None


@pytest.mark.parametrize(('file', 'kind', 'name'), [
    ('speed_history.json', 'ratios', 'default_by_opencv_depth'),
    ('movers_history.json', 'errors', 'poster, camera in a hand, room 3: error [mm]')])
def test_a_history_can_be_compared_with(release_history, file, kind, name):
    for entry in json.loads((FOLDER / file).read_text()):
        past = release_history.figures_of(entry, kind)
        assert name in past and entry['machine']['cpu']
        assert not release_history.worse(past, past)


@pytest.mark.parametrize(('name', 'stages'), [
    ('Stream', {'features', 'surface', 'registration', 'refinement', 'total'}),
    ('Pairwise', {'prepare', 'register', 'total'})])
def test_a_contestant_times_its_stages(load, monkeypatch, name, stages):
    monkeypatch.setattr('aick_ros.registration.stage_times.clock', time.process_time)
    camera = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=16, camera=camera))
    contestant = getattr(load(FOLDER / 'speed_worker.py'), name)(
        'default' if name == 'Stream' else 'aick-orb-350')
    contestant.skip(source.frame(0))
    times = contestant.timed(source.frame(1))
    assert set(times) == stages
    parts = sum(times.values()) - times['total']
    assert 0.0 < parts < 1.01 * times['total']  # the stages are parts of the whole
