# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node: colour and depth images in, odometry out, by the topics of rgbd_odometry."""

from __future__ import annotations

from aick_ros.ros.arguments import Arguments
from aick_ros.ros.parameter_node import ParameterNode
from aick_ros.ros.pipeline import Pipeline
from aick_ros.ros.process.node_program import run_node

_READ_ONCE = (' is read at the start only: give it to the node when it is started, in its '
              'parameter file or with -p')


class OdomNode(ParameterNode):
    """
    Visual odometry of an RGB-D camera, from the start to the end of the process.

    :param arguments: of the command line, beside those of ROS.
    :raises InputError: where a parameter cannot be used.
    """

    def __init__(self, arguments: Arguments = Arguments()) -> None:
        super().__init__(arguments)
        settings = self.declare()
        self._pipeline = Pipeline(self, settings.own, settings.core)
        self._pipeline.activate()
        settings.begin(self._pipeline.change_settings, _READ_ONCE)

    def run(self) -> None:
        """Answer frames until the context is shut down."""
        self._pipeline.start()
        super().run()

    def close(self) -> None:
        """Finish the frame at hand and end."""
        self._pipeline.close()
        super().close()


def main() -> None:
    """Run the node until SIGINT or SIGTERM."""
    run_node('odom_node', OdomNode)


if __name__ == '__main__':
    main()
