# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Versions that must be the same on all workers, for their results to be comparable."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

import aick_ros
from aick_ros import kernels
from aick_ros.errors import InputError

if TYPE_CHECKING:
    from distributed import Client

Versions = Mapping[str, str]
"""Name of a package -> its version."""


class OtherVersionsError(Exception):
    """A worker has other versions; the message says which, and where."""


@functools.cache
def own_versions() -> Versions:
    """Return the versions here; that of this package has a digest of its source code."""
    digest = hashlib.sha256()
    root = Path(aick_ros.__file__).parent
    for path in sorted(root.rglob('*.py')):
        digest.update(str(path.relative_to(root)).encode() + b'\0' + path.read_bytes())
    digest.update(kernels.DIGEST.encode())
    return {'aick_ros': f'{aick_ros.__version__}+{digest.hexdigest()[:12]}',
            'NumPy': np.__version__, 'OpenCV': cv2.__version__}


def other_versions(theirs: Versions, ours: Versions) -> str:
    """Return where the versions of a worker differ from ours; '' where they do not."""
    differences = ', '.join(f'{name} {theirs.get(name, "missing")} instead of {version}'
                            for name, version in ours.items() if theirs.get(name) != version)
    return f'it has other versions: {differences}' if differences else ''


def reject_other_versions(client: Client, say: Callable[[str], None],
                          ours: Versions | None = None) -> None:
    """
    Retire the workers that have other versions than we, or none.

    :param say: called with a sentence for each of them.
    :raises InputError: where no worker is left.
    """
    found = client.run(own_versions, on_error='return')
    rejected = []
    for worker, theirs in found.items():
        other = str(theirs) if isinstance(theirs, BaseException) else other_versions(
            theirs, ours or own_versions())
        if other:
            say(f'the worker {worker} is rejected: {other}')
            rejected.append(worker)
    if rejected:
        client.retire_workers(rejected)
        if len(rejected) == len(found):
            raise InputError('none of the workers can be used: install the same versions on them '
                             'as here')
