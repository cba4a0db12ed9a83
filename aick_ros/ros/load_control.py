# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Settings of the algorithm, and share of the frames, that the load permits."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from aick_ros.ros.load_shedding import Load, LoadShedding
from aick_ros.settings import NodeSettings, Settings


class LoadControl:
    """
    Has less computed, or more again, as the load of the last seconds demands.

    :param core: settings of the algorithm that count where there is time for all of it.
    :param apply: called with the settings that count from now on.
    :param warn: called with a sentence for each change of what is computed.
    """

    def __init__(self, settings: NodeSettings, core: Settings,
                 apply: Callable[[Settings], None], warn: Callable[[str], object]) -> None:
        self._sheds_load = settings.shed_load and not settings.process_every_frame
        self._core, self._apply, self._warn = core, apply, warn
        self._arrived, self._shedding = 0, LoadShedding()

    @property
    def dropped(self) -> str:
        """Work that is not done, in words."""
        return self._shedding.step.value

    @property
    def sentence(self) -> str:
        """The work that is dropped and a remedy; '' while everything is computed."""
        return self._shedding.sentence

    def admits_next(self) -> bool:
        """Count a frame that has arrived; return whether it is registered."""
        self._arrived += 1
        return self._shedding.admits(self._arrived)

    def change_settings(self, core: Settings) -> None:
        """Continue with other settings of the algorithm."""
        self._core = core
        self._apply(self._shedding.settings(core))

    def update(self, dropped: int, busy: Sequence[float], waited: float) -> None:
        """
        Take the load as it is now, once a second.

        :param dropped: number of frames dropped for newer ones since the start.
        :param busy: time that each thread has worked since then, without waits [s].
        :param waited: time that all of them have waited for transforms since then [s].
        """
        if self._sheds_load and self._shedding.update(
                Load(time.monotonic(), self._arrived, dropped, busy, waited)):
            self.change_settings(self._core)
            self._warn(self.sentence or 'everything is computed again')
