# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Error over the distance gone, a panel a recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from aick_ros.reports import canvas

_COLOURS = {'none': canvas.MUTED, 'keypoints': canvas.SECOND, 'joint': canvas.ESTIMATE}


def growth_figure(growths: Mapping[str, Mapping[str, Any]]) -> Figure:
    """
    Return the RMSE of the translation over parts of the path, by their length.

    :param growths: recording -> mode of the refinement -> as :func:`growth.growth` returns it.
    """
    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, len(growths), squeeze=False, sharey=True)[0]
        for axes, (recording, modes) in zip(panels, growths.items()):
            for mode, parts in modes.items():
                axes.plot([float(distance) for distance in parts],
                          [100 * part['translation_rmse_m'] for part in parts.values()],
                          color=_COLOURS[mode], marker='o', markersize=4.5, label=mode)
            axes.set(title=recording, xlabel='distance gone [m]', xlim=(0, None), ylim=(0, None))
        panels[0].set_ylabel('translation RMSE [cm]')
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc='outside lower center', ncols=len(labels),
                      title='refinement.mode')

    return canvas.figure(5.0 * len(growths), 4.2, draw)
