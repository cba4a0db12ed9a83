# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A disk without space."""

import errno

import pytest


@pytest.fixture
def full_disk(monkeypatch):
    """Let each write fail as on a full disk: files are made, but nothing can be in them."""
    from aick_ros.borders import replacement
    real = replacement.Path.write_bytes

    def fail(path, content):
        real(path, b'')
        raise OSError(errno.ENOSPC, 'No space left on device', str(path))
    monkeypatch.setattr(replacement.Path, 'write_bytes', fail)
