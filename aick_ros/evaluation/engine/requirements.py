# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Dask, its settings, and the memory that it requires, checked before they are used."""

from __future__ import annotations

import os
from pathlib import Path

from aick_ros.borders.address_space import check_address_space
from aick_ros.borders.files import read_bytes
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES
from aick_ros.errors import InputError, installation, package_of

_PLACES = ('DASK_CONFIG', 'DASK_ROOT_CONFIG')  # files or folders
_MEMORY = 1_000_000_000  # [byte] of addresses; measured: with 0.5 libraries abort, with 0.9 none


def check_dask() -> None:
    """
    Check that Dask is installed and reads its settings, as each of its processes will.

    :raises InputError: where it does not, or the process may not use the memory that it requires.
    """
    check_address_space(_MEMORY, 'processes that run tasks')
    for name in _PLACES:
        place = Path(os.environ.get(name, ''))
        if not place.is_dir() and place.exists():
            read_bytes(place, f'the settings of Dask ({name})', MAX_CONFIGURATION_BYTES)
    try:
        import dask
        import distributed  # noqa: F401  # which has settings of its own
        dask.config.collect()
    except ModuleNotFoundError as error:
        raise InputError(f"no tasks without {package_of(error)}: {installation('fleet')}"
                         ) from None
    except Exception as error:  # nearly anything, of any YAML
        raise InputError(f'Dask cannot be used ({error}): correct its settings, in DASK_* and '
                         '~/.config/dask') from None
