# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is drawn of an Allan deviation."""

import dataclasses

import numpy as np
import pytest

from aick_ros.evaluation.noise.imu_noise import estimate_imu_noise
from aick_ros.frames.imu import ImuSamples
from aick_ros.reports import canvas
from aick_ros.reports.allan_plot import allan_figure


@pytest.fixture
def noise():
    """Return the noise of an IMU with white noise of 0.01 per sample at 50 Hz."""
    rng, count = np.random.default_rng(0), 3000
    return estimate_imu_noise('office', ImuSamples(
        20_000_000 * np.arange(count), rng.normal(0.0, 0.01, (count, 3)),
        rng.normal(9.8, 0.01, (count, 3)) / np.sqrt(3)))


def line(axes, label):
    return next(line for line in axes.lines if line.get_label() == label)


def test_points_and_model_are_in_the_units_of_the_axes(noise):
    gyroscope, accelerometer = allan_figure(noise).axes
    for axes, unit, scale in ((gyroscope, 'deg/s', np.degrees(0.01)),
                              (accelerometer, 'm/s^2', 0.01 / np.sqrt(3))):
        assert axes.get_ylabel() == f'Allan deviation [{unit}]'
        assert axes.get_xlabel() == 'averaging time [s]'
        assert axes.get_title(loc='left').startswith('office: ')
        times, model = line(axes, 'model').get_data()
        np.testing.assert_allclose(model, scale * np.sqrt(0.02 / times), rtol=0.1)
        drawn = axes.containers[0].lines[0].get_ydata()
        assert drawn[0] == pytest.approx(scale, rel=0.05)
        assert axes.get_xscale() == axes.get_yscale() == 'log'


def test_tick_labels_are_plain_numbers(noise):
    figure = allan_figure(noise)
    figure.canvas.draw()
    labels = [label.get_text() for axes in figure.axes
              for label in axes.get_xticklabels() + axes.get_yticklabels()]
    assert all(label == f'{float(label):g}' for label in labels if label)


def test_a_sensor_that_has_not_measured_has_no_panel(noise):
    assert len(allan_figure(dataclasses.replace(noise, gyroscope=None)).axes) == 1


def test_each_axis_has_its_colour_and_the_error_of_its_points(noise):
    gyroscope, accelerometer = allan_figure(noise).axes
    assert [axes.get_title(loc='left') for axes in (gyroscope, accelerometer)] == [
        'office: gyroscope', 'office: accelerometer']
    for axes, sensor, scale in ((gyroscope, noise.gyroscope, 180 / np.pi),
                                (accelerometer, noise.accelerometer, 1.0)):
        labels = [text.get_text() for text in axes.get_legend().get_texts()]
        assert sorted(labels) == ['model', 'x', 'y', 'z']
        assert [container.get_label() for container in axes.containers] == ['x', 'y', 'z']
        for container, variances, colour in zip(axes.containers, sensor.allan.variances.T,
                                                canvas.SERIES):
            deviations = scale * variances ** 0.5
            points, _, (bars,) = container.lines
            assert points.get_color() == colour
            np.testing.assert_allclose(points.get_data(), [sensor.allan.times, deviations])
            # half the relative error of a variance is that of its root
            sizes = [abs(high - low) / 2 for (_, low), (_, high) in bars.get_segments()]
            np.testing.assert_allclose(
                sizes, deviations * (0.5 / sensor.allan.degrees_of_freedom) ** 0.5)
