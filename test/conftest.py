# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fixtures for all tests: recordings of real cameras, and ROS without neighbours."""

import itertools
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOMAINS = 101  # the ports of higher ones are those the system hands out to clients

_turns = itertools.count(7 * os.getpid())  # so that test runs side by side seldom meet


@pytest.fixture
def tum_folder():
    """Return a function from the name of a TUM sequence to its folder; it skips where none is."""
    def find(name):
        if 'AICK_DATA' not in os.environ:
            pytest.skip('no recordings: AICK_DATA names no folder with TUM sequences')
        folder = Path(os.environ['AICK_DATA'], name)
        if not folder.is_dir():
            pytest.skip(f'no recording: {folder} is not there')
        return folder
    return find


@pytest.fixture
def ros_domain(monkeypatch):
    """
    Give ROS, here and in processes started from here, a domain and a profile of this test's own.

    It returns the domain. Nothing leaves this machine, and images are not lost.
    """
    domain = 1 + next(_turns) % DOMAINS
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.setenv('FASTRTPS_DEFAULT_PROFILES_FILE', str(ROOT / 'config' / 'fastdds.xml'))
    return domain
