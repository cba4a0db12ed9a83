# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Draws of the noise of images, and the mean and the standard deviation over them."""

import statistics
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[2] / 'benchmarks'
DRAWS = 3


@pytest.fixture(scope='module')
def noise_draws(load):
    return load(FOLDER / 'noise_draws.py')


@pytest.fixture(scope='module')
def frames(source):
    return list(source.frames())


def test_the_first_draw_is_the_recording(noise_draws, frames):
    assert list(noise_draws.drawn(frames, 0)) == frames


def test_noise_is_of_each_grey_level_up_to_one_and_equally_often(noise_draws, frames):
    for drawn, frame in zip(noise_draws.drawn(frames, 3), frames, strict=True):
        inner = (frame.colour > 0) & (frame.colour < 255)
        noise = drawn.colour.astype(int)[inner] - frame.colour[inner]
        levels, counts = np.unique(noise, return_counts=True)
        assert levels.tolist() == [-1, 0, 1]
        assert counts / inner.sum() == pytest.approx(1 / 3, abs=0.01)
        assert (drawn.stamp, drawn.depth is frame.depth) == (frame.stamp, True)


def test_black_and_white_stay_within_the_range_of_an_image(noise_draws):
    image = np.tile(np.array([0, 255], np.uint8), (50, 1))
    found = noise_draws.with_noise(image, np.random.default_rng(0))
    assert found.dtype == np.uint8
    assert set(found[:, 0]) == {0, 1} and set(found[:, 1]) == {254, 255}


def test_noise_is_that_of_its_draw_and_of_its_frame(noise_draws, frames):
    once, again, other = (np.array([frame.colour for frame in noise_draws.drawn(frames, number)])
                          for number in (1, 1, 2))
    np.testing.assert_array_equal(once, again)
    assert (once != other).mean() > 0.5
    same = list(noise_draws.drawn(frames[:1] * 2, 1))
    assert (same[0].colour != same[1].colour).mean() > 0.5


def test_mean_and_standard_deviation_are_those_of_the_draws(noise_draws):
    draws = np.random.default_rng(2).normal(size=(DRAWS, 5))
    found = noise_draws.summary([noise_draws.Scores(*draw) for draw in draws])
    assert list(found) == ['mean', 'standard deviation']
    for column, values in enumerate(draws.T):
        assert found['mean'][column] == pytest.approx(statistics.mean(values))
        assert found['standard deviation'][column] == pytest.approx(statistics.stdev(values))


def test_a_recording_has_a_row_for_each_draw_and_two_for_all(noise_draws, frames, source,
                                                             monkeypatch):
    monkeypatch.setattr(noise_draws, 'frames_of', lambda *_: (frames, source.ground_truth))
    rows = [[cell.strip() for cell in row.strip('|').split('|')]
            for row in noise_draws.rows('a/recording', DRAWS)]
    assert [row[:2] for row in rows] == [
        ['recording', name] for name in ('as recorded', '1', '2', 'mean', 'standard deviation')]
    assert {len(row) for row in rows} == {noise_draws.HEAD.splitlines()[0].count('|') - 1}
    ate = [float(row[2]) for row in rows]
    assert 0 < ate[0] < 20 and ate[-2] == pytest.approx(np.mean(ate[:DRAWS]), abs=0.1)
    assert {row[3] for row in rows} == {'nan'}  # four frames are less than a second


def test_of_one_draw_there_is_no_standard_deviation(noise_draws, monkeypatch, capsys):
    monkeypatch.setattr(sys, 'argv', ['noise_draws.py', '--draws', '1', 'desk'])
    with pytest.raises(SystemExit):
        noise_draws.main()
    assert '--draws 1: at least 2 are required' in capsys.readouterr().err
