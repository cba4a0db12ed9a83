# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Content, settings and version of a run; with the same ones it need not be repeated."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Iterator

from aick_ros.cli.fleet.job import Job
from aick_ros.cli.fleet.recordings import is_path
from aick_ros.cli.fleet.remote import files_of
from aick_ros.cli.fleet.urls import is_url
from aick_ros.errors import InputError
from aick_ros.evaluation.engine.versions import own_versions
from aick_ros.settings.parameter import values


def state_of(source: str) -> str:
    """
    Return a digest of a recording's names, sizes and times of change; its images are not read.

    :raises InputError: where it cannot be read; TransferError where its server cannot be asked.
    """
    if is_url(source):
        return _digest(sorted((file.name, file.size, file.version) for file in files_of(source)))
    if not is_path(source):
        return source
    try:
        return _digest(sorted(_files(source)))
    except OSError as error:
        raise InputError(f'cannot read {source}: {error.strerror}') from None


def identity_of(job: Job, state: str) -> str:
    """
    Return a digest of all that a run depends on.

    :param state: of the recording, by :func:`state_of`.
    """
    return _digest([state, values(job.settings), list(map(_version, job.settings.files)),
                    dataclasses.asdict(job.options), list(job.gaps), job.limit,
                    dict(own_versions())])


def _version(path: str) -> tuple[str, int, int] | None:
    """Return what changes with the content of a file; None of one that is on workers alone."""
    try:
        return _facts(path, '')
    except (OSError, ValueError):  # ValueError: NUL in the name
        return None


def _files(source: str) -> Iterator[tuple[str, int, int]]:
    if not os.path.isdir(source):
        yield _facts(source, '')
        return
    for folder, _, names in os.walk(source):
        for name in names:
            path = os.path.join(folder, name)
            yield _facts(path, os.path.relpath(path, source))


def _facts(path: str, name: str) -> tuple[str, int, int]:
    facts = os.stat(path)
    return name, facts.st_size, facts.st_mtime_ns


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, default=str).encode()).hexdigest()[:32]
