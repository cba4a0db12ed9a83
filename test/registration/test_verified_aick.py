# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What confirms the refinement of a guessed pose."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.refinement.tracks import FEWEST_TO_CONFIRM
from aick_ros.registration.result import failed
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.registration.verified_aick import VerifiedAick
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values


@pytest.mark.parametrize('keypoints, fewest', [
    (400, 50), (100, 50), (60, 30), (10, FEWEST_TO_CONFIRM)])
def test_half_of_the_keypoints_that_can_be_tracked_confirm_a_guess(keypoints, fewest, monkeypatch):
    settings = with_values(Settings(), {'refinement.max_tracks': 100})
    registrar = VerifiedAick(settings, Aick(settings.aick), MeasuredNoise(),
                             MisalignmentEstimate(), StageTimes())
    source = SimpleNamespace(keypoints=range(keypoints))
    failure = failed(Status.TOO_FEW_MATCHES, '')
    for support, is_confirmed in ((fewest, True), (fewest - 1, False)):
        refined = dataclasses.replace(failure, status=Status.OK, support=support)
        monkeypatch.setattr(registrar, '_refine', lambda *_: refined)
        found = registrar._refine_guess(source, None, np.eye(4), failure)
        assert found is (refined if is_confirmed else failure)
