# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A folder of a run that is whole, or is not there."""

import os
from datetime import datetime

import pytest

from aick_ros.cli.output.run_folder import whole_folder

STARTED = datetime(2026, 1, 2, 3, 4, 5)


@pytest.mark.parametrize('error', [KeyboardInterrupt, RuntimeError])
def test_nothing_is_left_of_a_run_that_fails(tmp_path, error):
    with pytest.raises(error), whole_folder(tmp_path / 'deep' / 'runs', 'x', STARTED) as folder:
        (folder / 'bag').mkdir()
        (folder / 'bag' / 'bag.mcap').touch()
        raise error
    assert os.listdir(tmp_path) == []


def test_latest_stays_with_the_last_whole_run(tmp_path):
    with whole_folder(tmp_path, 'x', STARTED) as whole:
        (whole / 'trajectory.tum').touch()
    with pytest.raises(KeyboardInterrupt), whole_folder(tmp_path, 'x', STARTED) as folder:
        assert folder != whole
        raise KeyboardInterrupt
    assert sorted(os.listdir(tmp_path)) == ['latest', whole.name]
    assert (tmp_path / 'latest' / 'trajectory.tum').is_file()
