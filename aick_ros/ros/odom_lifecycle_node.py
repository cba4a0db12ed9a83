# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node with a life cycle, for a manager such as that of nav2."""

from __future__ import annotations

import gc
import re
import traceback
from collections.abc import Callable

from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn

from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.ros.arguments import Arguments
from aick_ros.ros.entities import Entities
from aick_ros.ros.parameter_node import ParameterNode
from aick_ros.ros.pipeline import Pipeline
from aick_ros.ros.process.node_program import run_node
from aick_ros.ros.process.program import RCLError

_Change = Callable[[ChangeState.Request, ChangeState.Response], ChangeState.Response]

_LABEL = re.compile('[a-z_]{1,50}')  # chosen: as all are
_THROTTLE = 5.0  # seconds between two log lines; chosen
_READ_ONCE = ' is read by configure only: clean the node up before, and configure it afterwards'


class OdomLifecycleNode(LifecycleNodeMixin, ParameterNode):
    """
    Visual odometry of an RGB-D camera, from one transition to another.

    Unconfigured it has parameters only, and each of them may be set. Configured it has its topics
    and services, but no images; active it is what :class:`OdomNode` is.

    :param arguments: of the command line, beside those of ROS.
    """

    def __init__(self, arguments: Arguments = Arguments()) -> None:
        ParameterNode.__init__(self, arguments)
        LifecycleNodeMixin.__init__(self)
        self._pipeline: Pipeline | None = None
        self._entities = Entities(self)
        service = self._service_change_state
        service.callback = self._without_exception(service.callback)
        try:
            self.declare(read_only=False)
        except InputError as error:
            self.get_logger().error(f'configure will fail: {error}')

    def close(self) -> None:
        """Finish the frame at hand and end."""
        self._clean_up()
        super().close()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the odometry from the parameters as they are now."""
        return self._attempt(self._configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take images."""
        return self._attempt(self._activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take no more images; the odometry is kept."""
        return self._attempt(self._configured.deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the odometry."""
        return self._attempt(self._clean_up)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the odometry for good."""
        return self._attempt(self._clean_up)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the odometry after a defect; the node can be configured anew."""
        return self._attempt(self._clean_up)

    @property
    def _configured(self) -> Pipeline:
        assert self._pipeline is not None  # by the state machine
        return self._pipeline

    def _attempt(self, act: Callable[[], None]) -> TransitionCallbackReturn:
        """Return how a transition went; rclpy would not log why one failed."""
        try:
            act()
        except InputError as error:
            self.get_logger().error(f'{error}')
            return TransitionCallbackReturn.FAILURE
        except Exception:
            if self.context.ok():  # otherwise a consequence of the shutdown
                self.get_logger().error('a transition failed, please report this:\n'
                                        f'{traceback.format_exc()}')
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _configure(self) -> None:
        settings = self.declare(read_only=False)
        self._entities = Entities(self)
        try:
            self._pipeline = Pipeline(self, settings.own, settings.core)
        except Exception:  # as of a defect: nothing else would destroy them
            self._entities.destroy()
            raise
        self._pipeline.start()
        settings.begin(self._pipeline.change_settings, _READ_ONCE)

    def _activate(self) -> None:
        inactive = Entities(self)
        try:
            self._configured.activate()
        except InputError:
            inactive.destroy()
            raise

    def _clean_up(self) -> None:
        if self._pipeline is not None:
            self.declare().end()
            self._pipeline.close()
            self._pipeline = None
            self._entities.destroy()
            gc.collect()  # images are held in cycles of references

    def _without_exception(self, change: _Change) -> _Change:
        """Return the service, which would end the node where a transition is not possible."""
        def change_state(request: ChangeState.Request, response: ChangeState.Response
                         ) -> ChangeState.Response:
            label = request.transition.label
            if label and not _LABEL.fullmatch(label):  # rcl would log it as it is
                self.get_logger().warning(f'there is no transition {quoted(label)}',
                                          throttle_duration_sec=_THROTTLE)
                response.success = False
                return response
            try:
                return change(request, response)
            except RCLError:
                if not self.context.ok():
                    raise  # a consequence of the shutdown
                response.success = False  # rcl has logged why
                return response
        return change_state


def main() -> None:
    """Run the node until SIGINT or SIGTERM."""
    run_node('odom_lifecycle_node', OdomLifecycleNode)


if __name__ == '__main__':
    main()
