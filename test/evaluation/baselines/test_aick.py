# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""AICK as a compared method: the settings it is given decide, and nothing else is run."""

import numpy as np
import pytest

from aick_ros.evaluation.baselines.aick import AickMethod
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CHANGES = {'features.max_keypoints': 120, 'aick.iterations': 4}


@pytest.fixture(scope='module')
def frames():
    source = SyntheticSource(SyntheticOptions.perfect(seed=4, frames=3))
    return source.frame(2), source.frame(0)


@pytest.mark.parametrize('name', ['paper-fast', 'paper-fast-surf'])
def test_the_papers_algorithm_runs_alone(frames, name):
    method = AickMethod(name, CHANGES)
    settings = with_values(preset(name), CHANGES)
    source, target = (method.prepare(frame) for frame in frames)
    assert len(source.keypoints) <= 120
    expected = Aick(settings.aick).align(source.keypoints, target.keypoints)
    estimate = method.register(source, target)
    np.testing.assert_array_equal(estimate.T_target_source, expected.T_target_source)


def test_the_defaults_are_refined(frames):
    method, registrar = AickMethod(changes=CHANGES), Registrar(with_values(Settings(), CHANGES))
    estimate = method.register(*map(method.prepare, frames))
    expected = registrar.register(*map(registrar.prepare, frames))
    np.testing.assert_array_equal(estimate.T_target_source, expected.T_target_source)
    assert estimate.failure == ''


def test_a_failure_has_the_reason_of_its_status(frames):
    method = AickMethod('paper-fast', {'features.max_keypoints': 2})
    source, target = (method.prepare(frame) for frame in frames)
    estimate = method.register(source, target)
    assert estimate.T_target_source is None
    assert estimate.failure == Aick(preset('paper-fast').aick).align(
        source.keypoints, target.keypoints).status.value
