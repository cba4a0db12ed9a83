# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Packages that every command needs, and a library user does not."""

from __future__ import annotations

from aick_ros.errors import installation, package_of

_NEEDED = ('typer', 'rich', 'yaml')


def missing_package(error: Exception) -> str:
    """Return the sentence about one of them that is not installed; '' for any other error."""
    package = package_of(error) if isinstance(error, ModuleNotFoundError) else ''
    return f"the command needs {package}: {installation('cli')}" if package in _NEEDED else ''
