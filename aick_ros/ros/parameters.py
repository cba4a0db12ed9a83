# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters of the settings: read at the start, changed while the node runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from rcl_interfaces.msg import (
    FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult)
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from aick_ros.errors import InputError
from aick_ros.features.vocabulary import vocabulary_of
from aick_ros.frames.mask import mask_of
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import Parameter, Value, hint, parameters, values, with_values
from aick_ros.settings.presets import PRESET, preset
from aick_ros.settings.rtabmap import is_theirs, translate

_Settings = TypeVar('_Settings', NodeSettings, Settings)
_MOST_WARNINGS = 20  # of parameters; chosen: more are of another node
_FRAMES = 'frame_id', 'odom_frame_id', 'guess_frame_id'
_OF_ROS = ('use_sim_time', 'start_type_description_service', 'qos_overrides.')


def declare_settings(node: Node, arguments: Mapping[str, str] = MappingProxyType({}),
                     read_only: bool = True) -> tuple[NodeSettings, Settings]:
    """
    Declare every parameter and return the settings.

    A preset replaces the defaults; single parameters change it. Parameters of ``rgbd_odometry``
    are read as those of this node where they mean the same.

    :param node: made with ``automatically_declare_parameters_from_overrides``, which accepts
        values of any type, so that the error message is that of the settings.
    :param arguments: parameters of ``rgbd_odometry`` from the command line; they take precedence.
    :param read_only: whether those that are read once can never be set.
    :raises InputError: naming the parameter, its range and its unit; none is declared then.
    """
    # a node made so returns parameters, not the bare values that its annotation says
    given = {name: getattr(parameter, 'value')
             for name, parameter in node.get_parameters_by_prefix('').items()}
    given.update(arguments)
    _warn_of_unknown(node, given)
    given.update(_read_theirs(node, given))
    chosen = str(PRESET.convert(given.get(PRESET.name, '')))
    own, core = _checked(_chosen(NodeSettings(), given)), _chosen(_from(chosen), given)
    _declare(node, PRESET, chosen, read_only)
    for group, is_read_once in ((own, True), (core, False)):
        for parameter in parameters(group):
            _declare(node, parameter, parameter.default, read_only and is_read_once)
    return own, core


def initial_pose(settings: NodeSettings) -> PoseWithCovariance:
    """
    Return the initial pose ``T_odom_base``, the identity unless ``initial_pose`` is set.

    :raises InputError: where the parameter is no pose.
    """
    numbers = settings.initial_pose
    if not numbers:
        return PoseWithCovariance.identity()
    if len(numbers) != 6 or not np.isfinite(numbers).all():
        raise InputError(f'initial_pose = {list(numbers)} is no pose: x y z [m] roll pitch yaw '
                         '[rad] are required')
    x, y, z, roll, pitch, yaw = numbers
    return PoseWithCovariance(se3.checked(
        se3.from_roll_pitch_yaw(roll, pitch, yaw, (x, y, z)), f'initial_pose = {list(numbers)}'))


class LiveSettings:
    """
    The settings of a node, and what may be set: all before it begins, then the algorithm's.

    :ivar own: settings that are read once.
    :ivar core: settings of the algorithm.
    """

    def __init__(self, own: NodeSettings, core: Settings) -> None:
        self.own, self.core = own, core
        self._on_change: Callable[[Settings], None] | None = None
        self._read_once = ''

    def begin(self, on_change: Callable[[Settings], None], read_once: str) -> None:
        """
        Pass on the algorithm's settings from now on, and fix the others.

        :param on_change: called with the new settings.
        :param read_once: what follows the name of another in the rejection.
        """
        self._on_change, self._read_once = on_change, read_once

    def end(self) -> None:
        """Let everything be set again."""
        self._on_change = None

    def set(self, asked: list[RosParameter],
            store: Callable[[list[RosParameter]], SetParametersResult]) -> SetParametersResult:
        """
        Set parameters all or none, after checking each one and all of them together.

        :param store: stores the parameters, unless ROS itself rejects them.
        """
        changes = {parameter.name: parameter.value for parameter in asked}
        try:
            own, core = self._changed(changes)
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        before, now = ({**values(group[0]), **values(group[1])}
                       for group in ((self.own, self.core), (own, core)))
        changed = {name: value for name, value in now.items()
                   if name in changes or value != before[name]}
        result = store([parameter for parameter in asked if parameter.name not in now]
                       + [RosParameter(name, value=_ros_value(value))
                          for name, value in changed.items()])
        if result.successful:
            is_new = core != self.core
            self.own, self.core = own, core
            if is_new and self._on_change is not None:
                self._on_change(core)
        return result

    def _changed(self, changes: Mapping[str, object]) -> tuple[NodeSettings, Settings]:
        names = values(NodeSettings)
        for name, value in changes.items():
            if self._on_change is not None and (name in names or name == PRESET.name):
                raise InputError(f'{name}{self._read_once}')
            if value is None and (name in names or name in values(Settings)
                                  or name == PRESET.name):  # ros2 param delete
                raise InputError(f'{name} cannot be deleted: set it to another value')
        chosen = changes.get(PRESET.name)
        own = _checked(with_values(self.own, {
            name: value for name, value in changes.items() if name in names}))
        core = with_values(self.core if chosen is None else _from(str(chosen)), {
            name: value for name, value in changes.items()
            if name not in names and name != PRESET.name and not name.startswith(_OF_ROS)})
        vocabulary_of(core)  # rejects one that cannot be read, or of another detector
        mask_of(core.sensor)  # likewise
        return own, core


def _from(chosen: str) -> Settings:
    """Return the settings of a preset, '' for the defaults."""
    return preset(chosen) if chosen else Settings()


def _warn_of_unknown(node: Node, given: Mapping[str, object]) -> None:
    known = [PRESET.name, *values(NodeSettings), *values(Settings)]
    unknown = [name for name in given
               if name not in known and not name.startswith(_OF_ROS) and not is_theirs(name)]
    for name in unknown[:_MOST_WARNINGS]:
        node.get_logger().warning(
            f'parameter {name!r} is not one of this node and changes nothing: '
            f'{hint(name, known)}')
    if len(unknown) > _MOST_WARNINGS:
        node.get_logger().warning(
            f'{len(unknown) - _MOST_WARNINGS} more parameters are not of this node and change '
            'nothing: are they in the file of another one?')


def _read_theirs(node: Node, given: Mapping[str, object]) -> dict[str, object]:
    """Return the parameters of this node that those of rgbd_odometry stand for, and say so."""
    translation = translate({name: value for name, value in given.items()
                             if not name.startswith(_OF_ROS)})
    for note in translation.notes:
        node.get_logger().info(note)
    for warning in translation.warnings:
        node.get_logger().warning(warning)
    return translation.values


def _chosen(group: _Settings, given: Mapping[str, object]) -> _Settings:
    known = values(group)
    return with_values(group, {  # an empty list comes as None
        name: value for name, value in given.items() if name in known and value is not None})


def _checked(own: NodeSettings) -> NodeSettings:
    """
    Return the settings with the names of frames as tf2 has them, without a slash in front.

    :raises InputError: where there can be no transform between two of them.
    """
    own = dataclasses.replace(own, **{name: getattr(own, name).lstrip('/') for name in _FRAMES})
    names = [name for name in _FRAMES if name != 'guess_frame_id' or own.guess_frame_id]
    frames = [getattr(own, name) for name in names]
    if '' in frames or own.frame_id in frames[1:]:
        raise InputError(' and '.join(f'{name} = {frame!r}' for name, frame in zip(names, frames))
                         + ': frame_id must differ from the others, and none be empty')
    return own


def _declare(node: Node, parameter: Parameter, value: Value, read_only: bool) -> None:
    if node.has_parameter(parameter.name):  # as the user set it, of any type
        node.undeclare_parameter(parameter.name)
    node.declare_parameter(parameter.name, _ros_value(value), _descriptor(parameter, read_only),
                           ignore_override=True)


def _ros_value(value: Value) -> Value | list[float]:
    # rclpy cannot infer the type of an empty list
    return (list(value) or '') if isinstance(value, tuple) else value


def _descriptor(parameter: Parameter, read_only: bool) -> ParameterDescriptor:
    unit = f' [{parameter.unit}]' if parameter.unit else ''
    descriptor = ParameterDescriptor(
        name=parameter.name, description=parameter.description + unit, read_only=read_only,
        dynamic_typing=parameter.type is tuple,
        additional_constraints=parameter.range_text if parameter.choices else '')
    if parameter.minimum is None or parameter.maximum is None:
        return descriptor
    if parameter.type is float:
        descriptor.floating_point_range = [FloatingPointRange(
            from_value=float(parameter.minimum), to_value=float(parameter.maximum))]
    elif parameter.type is int:
        descriptor.integer_range = [IntegerRange(
            from_value=int(parameter.minimum), to_value=int(parameter.maximum), step=1)]
    return descriptor
