# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Definitions of messages in a bag, compared with those of ROS."""

from __future__ import annotations

from functools import cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from aick_ros.borders.definitions import Types


def difference(types: Types, name: str, is_ros2: bool) -> str:
    """
    Return what of a type of ROS, and of the messages in it, is missing or of another kind.

    Fields beyond those of ROS, and other sizes of numbers, are no difference.

    :param types: those that a bag defines.
    :param name: of the type; one that is not of ROS, or that the bag does not define, has none.
    :returns: '' where there is none.
    """
    standard = _standard(is_ros2)
    if name not in types or name not in standard:
        return ''
    found = dict(types[name][1])
    for field, description in standard[name][1]:
        if field not in found:
            return f'{name} has no {field}'
        if _kind(found[field]) != _kind(description):
            return f'{field} of {name} is of another type than in ROS'
        if inner := difference(types, _message_in(description), is_ros2):
            return inner
    return ''


@cache
def _standard(is_ros2: bool) -> Types:
    """Return the types of ROS; ROS 1 has capital letters in some, and the others are alike."""
    ros2 = get_typestore(Stores.ROS2_JAZZY).fielddefs
    return ros2 if is_ros2 else {**ros2, **get_typestore(Stores.ROS1_NOETIC).fielddefs}


def _kind(description: Any) -> tuple[Any, ...]:
    """Return the kind of a field: integers of all sizes are of one, and so are other numbers."""
    node, content = description
    if node is Nodetype.NAME:
        return 'message', content
    if node is Nodetype.BASE:
        number = 'float' if content[0].startswith('float') else 'integer'
        return ('text' if 'string' in content[0] else number,)
    element, length = content
    return ('array', length if node is Nodetype.ARRAY else None, *_kind(element))


def _message_in(description: Any) -> str:
    """Return the type of the messages in a field; '' where they are none."""
    node, content = description
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        node, content = content[0]
    return str(content) if node is Nodetype.NAME else ''
