# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A run of the real node on a bag, over DDS."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import rclpy

from aick_ros.errors import InputError
from aick_ros.ros.playback.answers import LiveRun
from aick_ros.ros.playback.bag_player import BagPlayer
from aick_ros.ros.playback.listener import Listener, listening, wait_until
from aick_ros.ros.playback.node_process import NODE_COMMAND, node_process
from aick_ros.ros.process.program import initialise
from aick_ros.ros.process.resources import use_fastdds_profile
from aick_ros.settings.parameter import Value

_START_TIMEOUT = 60.0  # seconds; measured: 1 to 3, 15 where ten processes share a core


def run_live(bag: Path, remappings: Mapping[str, str], parameters: Mapping[str, Value],
             pace: Callable[[int], None], command: Sequence[str] = NODE_COMMAND,
             on_progress: Callable[[int], None] = lambda played: None) -> LiveRun:
    """
    Play a bag to the node in a process of its own and return its answers.

    :param remappings: the unresolved names ``rgb/image``, ``depth/image``, ``rgb/camera_info`` ->
        the topics of the bag.
    :param parameters: parameters of the node.
    :param pace: see :meth:`BagPlayer.play`.
    :param command: the command that starts the node.
    :param on_progress: called with the number of colour images played.
    :raises InputError: where the bag cannot be played or the node does not start.
    """
    use_fastdds_profile()
    initialise([], ends_by_signals=False)
    try:
        with node_process(command, remappings, parameters) as process, listening() as listener:
            player = BagPlayer(bag)
            _wait_for_node(bag, player, list(remappings.values()), process, listener)
            published_at: dict[int, float] = {}
            for played in player.play(pace):
                if played.topic == remappings['rgb/image'] and played.stamp is not None:
                    published_at[played.stamp] = played.published_at
                    on_progress(len(published_at))
            listener.wait_for_answers(published_at)
            return LiveRun(published_at, listener.answers).of_played_images()
    finally:
        rclpy.try_shutdown()


def _wait_for_node(bag: Path, player: BagPlayer, topics: Sequence[str],
                   process: subprocess.Popen[bytes], listener: Listener) -> None:
    missing = sorted(set(topics) - set(player.topics))
    if missing:
        raise InputError(f'{bag} has no topic {", ".join(missing)}')

    def is_ready() -> bool:
        return player.has_subscribers(topics) and listener.heard

    wait_until(lambda: process.poll() is not None or is_ready(), _START_TIMEOUT)
    if process.poll() is not None:
        raise InputError(f'odom_node ended at once with exit code {process.poll()}')
    if not is_ready():
        raise InputError(f'odom_node did not start within {_START_TIMEOUT:g} s')
