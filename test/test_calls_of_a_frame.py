# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames make the calls that docs/architecture.md shows, each one below its caller."""

import re
import sys
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import aick_ros
from aick_ros import Odometry, Settings, open_source
from aick_ros.frames.imu import ImuSamples
from aick_ros.settings.parameter import with_values

PACKAGE = Path(aick_ros.__file__).parent
PAGE = Path(__file__).parents[1] / 'docs' / 'architecture.md'


def calls_shown():
    """Return the functions that the page shows, each as (caller or None, function)."""
    shown, callers = [], []
    for indent, file, name in re.findall(r'^( *)([\w/]+\.py): ([\w.]+)  ', PAGE.read_text(),
                                         re.MULTILINE):
        callers = callers[:len(indent) // 2]
        shown.append((callers[-1] if callers else None, (str(PACKAGE / file), name)))
        callers.append(shown[-1][1])
    return shown


@contextmanager
def noted(functions, made):
    """Note which functions are called, directly or not, by which others of them."""
    names, active = {name.rpartition('.')[2] for _, name in functions}, []

    def note(frame, event, argument):
        code = frame.f_code
        function = code.co_filename, code.co_qualname
        if code.co_name not in names or function not in functions:
            return
        if event == 'call':
            made.update((caller, function) for caller in (None, *active))
            active.append(function)
        elif event == 'return':
            active.pop()
    sys.setprofile(note)
    try:
        yield
    finally:
        sys.setprofile(None)


@pytest.fixture(scope='module')
def frames():
    """Return frames with samples of an IMU; one repeats, one is dark, one is blind."""
    rest = np.zeros((1, 3)), np.array([[0.0, -9.8, 0.0]])
    seen = [replace(frame, imu=ImuSamples(np.array([frame.stamp]), *rest))
            for frame in islice(open_source('synthetic:1').frames(), 7)]
    seen[4] = replace(seen[4], colour=seen[3].colour, depth=seen[3].depth)
    seen[5] = replace(seen[5], colour=np.zeros_like(seen[5].colour))
    seen[6] = replace(seen[6], colour=np.zeros_like(seen[6].colour),
                      depth=np.full_like(seen[6].depth, np.nan))
    return seen


def test_each_call_is_made_below_its_caller(frames):
    shown, made = calls_shown(), set()
    assert len(shown) > 40
    for interval in (1, 2):
        odometry = Odometry(with_values(Settings(), {'odometry.aick_interval': interval}))
        with noted({function for _, function in shown}, made):
            for frame in frames:
                odometry.register_frame(frame)
    assert [call for call in shown if call not in made] == []
