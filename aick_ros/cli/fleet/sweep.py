# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Settings that are varied: every combination of the values of ``--vary``."""

from __future__ import annotations

import itertools
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from aick_ros.cli.input.options import require_of_algorithm
from aick_ros.errors import InputError
from aick_ros.features.vocabulary import shipped
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values, with_values

_MOST = 1000  # chosen


@dataclass(frozen=True)
class Variant:
    """
    Settings with their name.

    :param name: of its folder; the values that are varied.
    :param varied: dotted name -> value as it is given, of those that are varied.
    """

    name: str
    settings: Settings
    varied: Mapping[str, object]


def variants(settings: Settings, vary: Sequence[str]) -> list[Variant]:
    """
    Return all combinations of values, files by their absolute paths.

    :param vary: each ``NAME=VALUE,VALUE,...``.
    :raises InputError: for an unknown name, an invalid value, or too many combinations.
    """
    axes = dict(map(_axis, vary))
    require_of_algorithm('--vary', axes)
    if len(axes) < len(vary):
        raise InputError('--vary names a parameter twice: give all of its values at once')
    combinations = list(itertools.islice(itertools.product(*axes.values()), _MOST + 1))
    if len(combinations) > _MOST:
        raise InputError(f'--vary makes more than {_MOST} combinations: name fewer values')
    return [_variant(settings, dict(zip(axes, chosen))) for chosen in combinations]


def _axis(text: str) -> tuple[str, list[str]]:
    name, equals, choices = text.partition('=')
    chosen = list(dict.fromkeys(choice.strip() for choice in choices.split(',')))
    if not equals or not all(chosen):
        raise InputError(f'--vary {text}: NAME=VALUE,VALUE is required, for example --vary '
                         'refinement.mode=none,joint')
    return name.strip(), chosen


def _variant(settings: Settings, chosen: Mapping[str, str]) -> Variant:
    changed = with_values(settings, chosen)
    every = values(changed)
    varied = {name: every[name] for name in chosen}
    changed = with_values(changed, {
        name: os.path.abspath(os.path.expanduser(path)) for name, path in (
            ('sensor.mask', changed.sensor.mask), ('aick.vocabulary', changed.aick.vocabulary))
        if path and path not in shipped()})  # workers may work in other folders
    name = ','.join(f'{name}={value}' for name, value in chosen.items())
    return Variant(name or 'settings', changed, varied)
