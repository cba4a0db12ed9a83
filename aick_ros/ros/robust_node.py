# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node that rejects what rclpy takes on trust."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription
from rosgraph_msgs.msg import Clock

from aick_ros.geometry.stamps import MAX_STAMP
from aick_ros.ros.conversions import to_stamp

_THROTTLE = 5.0  # seconds between two log lines; chosen
_Serve = Callable[[Any, Any], Any]


class RobustNode(Node):
    """
    A node that goes on where rclpy's own callbacks would raise, which ends a node.

    These are the callbacks of /clock and of the services that set parameters.
    """

    def create_subscription(self, msg_type: Any, topic: str, callback: Callable[[Any], None],
                            *arguments: Any, **options: Any) -> Subscription:
        """Create a subscription; that of /clock ignores impossible times."""
        if msg_type is Clock:
            callback = self._ignoring_impossible_times(callback)
        return super().create_subscription(msg_type, topic, callback, *arguments, **options)

    def create_service(self, srv_type: Any, srv_name: str, callback: _Serve,
                       *arguments: Any, **options: Any) -> Service:
        """Create a service; those that set parameters reject values of no type."""
        if srv_type is SetParameters:
            callback = _rejecting_unknown_types(callback, _reject_each)
        elif srv_type is SetParametersAtomically:
            callback = _rejecting_unknown_types(callback, _reject_all)
        return super().create_service(srv_type, srv_name, callback, *arguments, **options)

    def _ignoring_impossible_times(self, take: Callable[[Clock], None]
                                   ) -> Callable[[Clock], None]:
        def take_possible(message: Clock) -> None:
            stamp = to_stamp(message.clock)
            if 0 <= stamp <= MAX_STAMP:
                take(message)
            else:
                self.get_logger().warning(
                    f'a time on /clock is ignored: {stamp} ns is not from 0 to {MAX_STAMP}; check '
                    'its publisher', throttle_duration_sec=_THROTTLE)
        return take_possible


def _rejecting_unknown_types(serve: _Serve, reject: Callable[[Any, Any, str], None]) -> _Serve:
    def serve_known(request: Any, response: Any) -> Any:
        unknown = next((parameter for parameter in request.parameters
                        if parameter.value.type > ParameterType.PARAMETER_STRING_ARRAY), None)
        if unknown is None:
            return serve(request, response)
        reject(request, response, f'a value has type {unknown.value.type}, which no parameter of '
                                  'ROS has')
        return response
    return serve_known


def _reject_each(request: SetParameters.Request, response: SetParameters.Response,
                 reason: str) -> None:
    response.results = [SetParametersResult(reason=reason) for _ in request.parameters]


def _reject_all(request: SetParametersAtomically.Request,
                response: SetParametersAtomically.Response, reason: str) -> None:
    response.result = SetParametersResult(reason=reason)
