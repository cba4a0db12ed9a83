# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Bootstrap of means of a time series by blocks (Politis and Romano 1992, circular blocks).

Errors of neighbouring frames are alike, so single frames must not be drawn: blocks are, longer
than the errors remember.
"""

from __future__ import annotations

import numpy as np

REPLICATES = 2000  # chosen: ten beyond each end of a 99 % interval
_LEAST_BLOCKS = 4  # chosen
_SEED = 20130925  # chosen: the same data have the same interval


def replicates_of_means(series: np.ndarray, block: int, seed: int = _SEED) -> np.ndarray:
    """
    Return means of resampled series, that draw the same blocks.

    :param series: KxN, K series over the same N >= 1 frames.
    :param block: length of the blocks in frames, at most a quarter of the series.
    :returns: KxREPLICATES.
    """
    frames = series.shape[1]
    block = max(1, min(block, frames // _LEAST_BLOCKS))
    count = -(-frames // block)
    starts = np.random.default_rng(seed).integers(frames, size=(REPLICATES, count))
    wrapped = np.concatenate([series, series[:, :block]], axis=1)
    sums = np.concatenate([np.zeros((len(series), 1)), np.cumsum(wrapped, axis=1)], axis=1)
    blocks = (sums[:, block:] - sums[:, :-block]) / block
    means: np.ndarray = blocks[:, starts].mean(axis=2)
    return means
