# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""An example that is run without a recording says how it is used."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / 'examples').glob('*.py'))


@pytest.mark.parametrize('example', EXAMPLES, ids=lambda path: path.stem)
def test_without_arguments_the_usage_is_printed(example):
    ended = subprocess.run([sys.executable, str(example)], capture_output=True, text=True)
    assert ended.returncode == 1
    assert f'usage: {example.name} ' in ended.stderr
    assert 'Traceback' not in ended.stderr
