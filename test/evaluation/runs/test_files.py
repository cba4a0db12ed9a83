# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Users and scripts know the files of a run by the names in the documentation."""

from pathlib import Path

from aick_ros.evaluation.runs import files

DOCS = Path(__file__).parents[3] / 'docs'


def test_the_names_are_the_documented_ones():
    text = (DOCS / 'command.md').read_text()
    names = [value for name, value in vars(files).items() if name.isupper()]
    assert len(names) == 6
    assert [name for name in names if f'`{name}`' not in text] == []
