# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files of measured lines that cannot be resumed."""

import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.benchmark.journal import Journal


@pytest.mark.parametrize(('lines', 'message'), [
    ('{"recordings": {}}\n', 'other recordings'),
    ('HEADER\nnonsense\n', 'line 2 is not a result'),
    ('HEADER\n{"method": "a"}\n', 'line 2 is not a result')])
def test_a_file_of_another_run_is_rejected(recording, tmp_path, lines, message):
    path = tmp_path / 'x.partial'
    Journal(path, [recording]).close()
    path.write_text(lines.replace('HEADER', path.read_text().strip()))
    with pytest.raises(InputError, match=message):
        Journal(path, [recording])
