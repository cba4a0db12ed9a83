# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters made from settings.py."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from aick_ros import settings
from aick_ros.errors import InputError
from aick_ros.settings import NodeSettings, Parameter, Settings

_PRESET = Parameter(
    'preset', str, '', 'Start from the parameters of the paper, '
    + ' or '.join(settings.PRESETS) + "; '': from the defaults.")


def declare_settings(node: Node) -> tuple[NodeSettings, Settings]:
    """
    Declare every parameter of settings.py and return what the user has set.

    The preset is taken first, single parameters change it.

    :raises InputError: naming the parameter, its range and its unit.
    """
    preset = _override(node, _PRESET)
    core = settings.preset(_PRESET.convert(preset)) if preset else Settings()
    node.declare_parameter(_PRESET.name, preset, _descriptor(_PRESET), ignore_override=True)
    return _checked(_declare(node, NodeSettings())), _declare(node, core)


def _checked(own: NodeSettings) -> NodeSettings:
    """Refuse frames between which there can be no transform."""
    if not own.frame_id or not own.odom_frame_id or own.frame_id == own.odom_frame_id:
        raise InputError(f'frame_id = {own.frame_id!r} and odom_frame_id = {own.odom_frame_id!r}: '
                         'they must be two different frames')
    return own


def _declare(node: Node, group: Any) -> Any:
    """Declare a group of parameters, its present values as defaults; return the values set."""
    chosen = settings.with_values(group, {
        parameter.name: _override(node, parameter) for parameter in settings.parameters(group)})
    for parameter in settings.parameters(chosen):
        node.declare_parameter(parameter.name, _ros_value(parameter.default),
                               _descriptor(parameter), ignore_override=True)
    return chosen


def _override(node: Node, parameter: Parameter) -> Any:
    """Return what the user set, of whatever type, so that our own check can explain a refusal."""
    value = node.declare_parameter(parameter.name, _ros_value(parameter.default),
                                   ParameterDescriptor(dynamic_typing=True)).value
    node.undeclare_parameter(parameter.name)
    return parameter.default if value is None else value  # an empty list comes as None


def _ros_value(value: Any) -> Any:
    # of an empty list rclpy cannot tell the type
    return (list(value) or '') if isinstance(value, tuple) else value


def _descriptor(parameter: Parameter) -> ParameterDescriptor:
    unit = f' [{parameter.unit}]' if parameter.unit else ''
    descriptor = ParameterDescriptor(
        name=parameter.name, description=parameter.description + unit, read_only=True,
        dynamic_typing=parameter.type is tuple,
        additional_constraints=parameter.range_text if parameter.choices else '')
    if parameter.type is float:
        descriptor.floating_point_range = [FloatingPointRange(
            from_value=float(parameter.minimum), to_value=float(parameter.maximum))]
    elif parameter.type is int:
        descriptor.integer_range = [IntegerRange(
            from_value=int(parameter.minimum), to_value=int(parameter.maximum), step=1)]
    return descriptor
