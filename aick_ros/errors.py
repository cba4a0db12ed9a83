# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors that a user can mend: input that cannot be used, packages that are missing."""


class InputError(ValueError):
    """Input that cannot be used; the message says what, where and what to do."""


class TransferError(InputError):
    """Input that could not be read or copied from where it lies; another try may succeed."""


def package_of(error: ModuleNotFoundError) -> str:
    """Return the package that is missing, or a part of it."""
    return (error.name or '').partition('.')[0]


def installation(extra: str) -> str:
    """Return how to install what an extra of this package needs; no index has the package."""
    return f"pip install '.[{extra}]' in the folder of aick_ros"
