# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The parameter file of the node, as settings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES
from aick_ros.borders.yaml_text import parse_parameters
from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset

NODE = 'odom_node'

_PARAMETERS = 'ros__parameters'
_OF_ROS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')
_SHAPE = (f'write the parameters under "{_PARAMETERS}:", and that under "{NODE}:" or "/**:", as '
          '"aick parameters --format yaml" does')


@dataclass(frozen=True)
class SettingsFile:
    """
    Content of a parameter file.

    :param preset: the preset it names, or None.
    :param changes: dotted name -> value, of the algorithm and of the node.
    """

    path: Path
    preset: str | None
    changes: Mapping[str, Any]

    def applied_to(self, settings: Settings) -> Settings:
        """
        Return the settings with the values of the file; parameters of the node are only checked.

        :raises InputError: naming the file, for an unknown name or an invalid value.
        """
        try:
            changed = with_values(_CoreAndNode(**vars(settings)), self.changes)
        except InputError as error:
            raise InputError(f'{self.path}: {error}') from None
        return Settings(**{name: getattr(changed, name) for name in vars(settings)})


@dataclass(frozen=True)
class _CoreAndNode(NodeSettings, Settings):
    """All parameters that a parameter file may have."""


def _preset(name: str, path: Path) -> str:
    """Return the name of a preset; InputError, naming the file, where there is no such."""
    try:
        preset(name)
    except InputError as error:
        raise InputError(f'{path}: {error}') from None
    return name


def read_settings_file(path: Path) -> SettingsFile:
    """
    Read a ROS parameter file: the sections for all nodes and for this node.

    :raises InputError: naming the file, where it cannot be read or has no such section.
    """
    text = read_text(path, 'the settings', MAX_CONFIGURATION_BYTES)
    try:
        content = parse_parameters(text)
    except InputError as error:
        raise InputError(f'cannot read the settings {path}: {error}') from None
    sections = list(_sections(content, ''))
    if not sections:
        raise InputError(f'{path} has no parameters: {_SHAPE}')
    ours = [values for node, values in sections if node.split('/')[-1] in (NODE, '*', '**')]
    if not ours:
        names = ', '.join(node for node, _ in sections)
        raise InputError(f'{path} has parameters of {names}, but none of {NODE}: {_SHAPE}')
    changes: dict[str, Any] = {}
    for values in ours:
        changes.update(_flat(values, '', path))
    named = changes.pop('preset', None)
    return SettingsFile(path, _preset(str(named), path) if named else None, {
        name: value for name, value in changes.items() if name.split('.')[0] not in _OF_ROS})


def _sections(content: Any, node: str) -> Iterator[tuple[str, Any]]:
    """Yield the name and parameters of each node; names may be nested as namespaces."""
    if not isinstance(content, Mapping):
        return
    for key, value in content.items():
        if key == _PARAMETERS:
            yield node, value
        else:
            yield from _sections(value, f'{node}/{str(key).strip("/")}')


def _flat(values: Any, prefix: str, path: Path) -> Iterator[tuple[str, Any]]:
    if not isinstance(values, Mapping):
        where = prefix.rstrip('.') or _PARAMETERS
        raise InputError(f'{path}: {where} has no parameters: {_SHAPE}')
    for key, value in values.items():
        name = f'{prefix}{key}'
        if isinstance(value, Mapping):
            yield from _flat(value, f'{name}.', path)
        elif value is None:
            raise InputError(f'{path}: {name} has no value, which ROS rejects, too: give one, or '
                             "remove the line; an empty text is ''")
        else:
            yield name, value
