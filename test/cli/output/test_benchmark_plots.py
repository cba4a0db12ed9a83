# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The files of the figures of a benchmark, with and without a walk."""

from types import SimpleNamespace

import pytest

from aick_ros.cli.output.benchmark_plots import FigureFolder
from aick_ros.errors import InputError
from aick_ros.reports import benchmark_plots, reckoning_plot


@pytest.mark.parametrize('reckoning', [None, SimpleNamespace()])
def test_figure_10_is_that_of_the_walk(monkeypatch, tmp_path, reckoning):
    written = []
    monkeypatch.setattr(benchmark_plots, 'write_figures',
                        lambda *arguments: written.append(arguments))
    monkeypatch.setattr(reckoning_plot, 'write_reckoning',
                        lambda *arguments: written.append(arguments))
    folder = FigureFolder(tmp_path / 'plots')
    assert (tmp_path / 'plots').is_dir()
    folder.write({'3': {}}, {'room': {}}, reckoning)
    walk = [(reckoning, tmp_path / 'plots' / 'figure-10.png')] if reckoning else []
    assert written == [({'3': {}}, {'room': {}}, tmp_path / 'plots'), *walk]
    assert folder.vocabularies == tmp_path / 'plots' / 'vocabularies'
    assert not folder.vocabularies.exists()


def test_a_folder_that_cannot_be_made_is_named_before_the_run(tmp_path):
    (tmp_path / 'plots').touch()
    with pytest.raises(InputError, match=f'{tmp_path}/plots'):
        FigureFolder(tmp_path / 'plots')
