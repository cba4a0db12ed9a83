# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parameter files that are given to a program: those it cannot read, or that are not for it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from aick_ros.borders.files import read_bytes, read_text
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES
from aick_ros.borders.yaml_text import parse_yaml
from aick_ros.errors import InputError

_WHAT = 'the parameters'
_REMAPPINGS = 'remappings'  # of topics, in the files of config/cameras; by definition


def check_parameter_files(argv: Sequence[str]) -> None:
    """
    Check parameter files before ROS reads them, whatever they are, to their end.

    :param argv: the arguments of the process.
    :raises InputError: where one is missing, a pipe, a device, too large, or that of a camera.
    """
    for file in _files(argv):
        read_bytes(file, _WHAT, MAX_CONFIGURATION_BYTES)
        content = _content(file)
        if isinstance(content, dict) and _REMAPPINGS in content:
            raise InputError(
                f'{file} is the file of a camera, in which ROS cannot read {_REMAPPINGS}: start '
                f'odometry.launch.py with camera:={file.stem}, or give topics with -r and the '
                'rest in a file of its own')


def warnings_of_files(argv: Sequence[str], node_name: str) -> Iterator[str]:
    """
    Yield a sentence for each parameter file of which the node reads nothing.

    :param argv: the arguments of the process.
    :param node_name: name of the node with its namespace.
    """
    for file in _files(argv):
        names = [name for name in _nodes(_content(file), '') if name]
        if names and not any(_matches(name, node_name) for name in names):
            yield (f'nothing in {file} is read: it is for {", ".join(names)}, and this node is '
                   f'{node_name}; rename one of them (-r __node:=NAME), or write /** in the file')


def _files(argv: Sequence[str]) -> Iterator[Path]:
    return (Path(file) for option, file in zip(argv, argv[1:]) if option == '--params-file')


def _content(file: Path) -> object:
    try:
        return parse_yaml(read_text(file, _WHAT, MAX_CONFIGURATION_BYTES))
    except InputError:
        return None  # ROS has said so, or will


def _nodes(content: object, above: str) -> Iterator[str]:
    """Yield the full names of the nodes in a parameter file."""
    if not isinstance(content, dict):
        return
    for key, value in content.items():
        if key == 'ros__parameters':
            yield above
        else:
            yield from _nodes(value, f'{above}/{str(key).strip("/")}')


def _matches(pattern: str, node_name: str) -> bool:
    """Return whether a name in which * stands for one part and ** for any is that of the node."""
    parts = (re.escape(pattern).replace(r'/\*\*', '(/[^/]+)*').replace(r'\*', '[^/]+'))
    return re.fullmatch(parts, node_name) is not None
