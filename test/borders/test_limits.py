# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The limits are those that the documentation lists."""

import re
from pathlib import Path

from aick_ros.borders import limits

PAGE = (Path(__file__).parents[2] / 'docs' / 'limits.md').read_text()


def test_the_documentation_lists_every_limit():
    listed = {name: float(value) for value, name in re.findall(
        r'\| ([\d.]+) \| `(M\w+)` \|', PAGE)}
    assert listed == {name: value for name, value in vars(limits).items()
                      if name.startswith('M')}
