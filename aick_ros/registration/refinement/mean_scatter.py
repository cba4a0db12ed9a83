# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Shape of the scatter of one kind of residuals, as a mean over the registrations of one camera.

The scatter between some dozen blocks of one image says little of six directions: by chance some
scatter by a third of what they do in the mean, others by three times as much. Where they do so by
a third, a covariance by that scatter alone is too small. In units of the information, scatter of
independent noise is the identity, whatever the view. That of one camera changes slowly with the
view: the mean of many registrations shows its shape, while that of one shows its scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

# All chosen on two excerpts of real recordings and on rendered rooms with twelve kinds of cameras.
SHARE = 0.9
"""Share of the mean in the shape that is expected of a scatter."""

_MEMORY = 60  # registrations that the mean is over
_PRIOR_COUNT = 5  # registrations that the prior counts for: scatter as of independent noise


@dataclass(frozen=True, eq=False)
class MeanScatter:
    """
    Mean over the registrations so far.

    :param shape: 6x6, in units of the information, with a trace of 6.
    :param count: number of registrations, with those that the prior counts for.
    """

    shape: np.ndarray = field(default_factory=lambda: np.eye(6))
    count: int = _PRIOR_COUNT

    def with_sample(self, scatter: np.ndarray) -> MeanScatter:
        """
        Return the mean with the scatter of one more registration.

        :param scatter: 6x6, in units of the information; without any it changes nothing.
        """
        scale = float(np.trace(scatter)) / 6
        if not 0.0 < scale < math.inf:
            return self
        count = min(self.count + 1, _MEMORY)
        return MeanScatter(self.shape + (scatter / scale - self.shape) / count, count)
