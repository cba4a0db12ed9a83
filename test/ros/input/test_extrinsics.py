# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses of cameras that are not known: which frames are missing, and what to do."""

from types import SimpleNamespace

import pytest

from aick_ros.errors import InputError
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.settings.node import NodeSettings


@pytest.mark.parametrize('frame, remedy', [
    ('camera', "or set frame_id to 'camera'"),
    ('', 'has no frame_id: let the driver set it, or set camera_in_base')])
def test_an_unknown_camera_is_explained(frame, remedy):
    extrinsics = Extrinsics(SimpleNamespace(find=lambda *_: None), NodeSettings())
    with pytest.raises(InputError, match=remedy):
        extrinsics.camera_in_base(frame, 0, wait=False)
