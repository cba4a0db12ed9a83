# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The accelerometer of a TUM folder: the axes of the camera, and each line that can be bad."""

import numpy as np
import pytest

from aick_ros.borders.limits import MAX_ACCELERATION
from aick_ros.errors import InputError
from aick_ros.sources import raise_damage
from aick_ros.sources.tum import TumSource
from aick_ros.sources.tum_accelerometer import read_accelerations


def test_samples_are_in_order_and_in_the_axes_of_the_camera(tmp_path):
    (tmp_path / 'accelerometer.txt').write_text(
        '# timestamp ax ay az\n  # g\n2.5 0.1 9.8 -0.3\n1.5 1 2 3\n\n1.5 7 7 7\n')
    samples = read_accelerations(tmp_path)
    assert samples.stamps.tolist() == [1_500_000_000, 2_500_000_000]
    assert samples.accelerations.tolist() == [[-1, -2, 3], [-0.1, -9.8, -0.3]]
    assert np.isnan(samples.turn_rates).all()


def test_a_folder_without_has_none(tmp_path):
    assert read_accelerations(tmp_path) is None


@pytest.mark.parametrize('line', ['1.5 1 2', '1.5 1 2 3 4', 'a 1 2 3', '1.5 1 2 nan', '-1 1 2 3',
                                  '1.5 1 2 -inf', '1.5 1e300 2 3'])
def test_a_line_that_cannot_be_read_is_named(tmp_path, line):
    (tmp_path / 'accelerometer.txt').write_text(f'# t\n{line}\n')
    with pytest.raises(InputError, match=(
            (
            r'accelerometer.txt, line 2: .* is not an acceleration: required are a stamp \[s\] '
            r'and three numbers \[m/s\^2\]$'))):
        read_accelerations(tmp_path)


def test_frames_have_the_samples_since_the_frame_before(real_folder):
    frames = []
    for frame in TumSource(real_folder).frames(raise_damage):
        frames.append(frame)
        if len(frames) == 4:
            break
    first, *others = (frame.imu for frame in frames)
    stamps = [frame.stamp for frame in frames]
    assert first.stamps[0] < stamps[0] - 400_000_000
    assert first.stamps[-1] <= stamps[0]
    for samples, before, now in zip(others, stamps, stamps[1:]):
        assert before < samples.stamps[0] <= samples.stamps[-1] <= now
    # a camera held upright: gravity points against its y axis
    assert np.mean(first.accelerations, axis=0)[1] < -5.0


@pytest.mark.parametrize('axis', range(3))
@pytest.mark.parametrize('sign', [1, -1])
def test_the_largest_acceleration_is_within(tmp_path, axis, sign):
    values = [0.0, 0.0, 0.0]
    for value, is_within in ((MAX_ACCELERATION, True), (MAX_ACCELERATION + 1e-9, False)):
        values[axis] = sign * value
        (tmp_path / 'accelerometer.txt').write_text(f'1.5 {" ".join(map(repr, values))}\n')
        if is_within:
            assert abs(read_accelerations(tmp_path).accelerations[0, axis]) == MAX_ACCELERATION
        else:
            with pytest.raises(InputError, match='line 1: '):
                read_accelerations(tmp_path)


def test_a_link_to_nowhere_is_not_taken_for_none(tmp_path):
    (tmp_path / 'accelerometer.txt').symlink_to('nowhere.txt')
    with pytest.raises(InputError, match='accelerometer.txt: No such file'):
        read_accelerations(tmp_path)


def test_an_empty_file_has_no_samples_but_is_one(tmp_path):
    (tmp_path / 'accelerometer.txt').write_text('# nothing\n')
    assert len(read_accelerations(tmp_path)) == 0
