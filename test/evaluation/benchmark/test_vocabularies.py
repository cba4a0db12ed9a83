# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The vocabularies of the figure that compares their sizes."""

import pytest

from aick_ros.evaluation.baselines.registry import make
from aick_ros.evaluation.benchmark.figures import paper_figures, variants
from aick_ros.evaluation.benchmark.vocabularies import (
    DETECTORS, SIZES, file_name, learn, missing_from, training_frames)
from aick_ros.features.vocabulary import load

FEW = [('orb', 10), ('surf', 30)]


@pytest.fixture(scope='module')
def learned(tmp_path_factory):
    """Return a folder with vocabularies learned from one frame, and the progress reported."""
    folder, progress = tmp_path_factory.mktemp('vocabularies'), []
    frames = iter([next(training_frames())])
    for wanted, vocabulary in learn(FEW, frames, progress.append):
        (folder / file_name(wanted)).write_bytes(vocabulary.to_bytes())
    return folder, progress


def test_learns_so_many_words_of_the_detector(learned):
    folder, progress = learned
    for detector, size in FEW:
        vocabulary = load(folder / file_name((detector, size)))
        assert (vocabulary.detector, len(vocabulary)) == (detector, size)
    assert progress == [1, 2, 3]


def test_learns_only_what_is_missing(learned):
    every = [(detector, size) for detector in DETECTORS for size in SIZES]
    assert missing_from(learned[0]) == [wanted for wanted in every if wanted not in FEW]
    assert missing_from(learned[0] / 'nowhere') == every
    assert min(SIZES) == 10 and max(SIZES) == 5000


def test_the_figures_have_a_curve_for_each_size(learned):
    folder = learned[0]
    sized = {method.options['changes']['aick.vocabulary']: method
             for method in variants(paper_figures(folder))
             if 'aick.vocabulary' in method.options['changes']}
    assert len(sized) == 2 * len(SIZES)
    assert len(variants(paper_figures())) == len(variants(paper_figures(folder))) - len(sized)
    for detector, size in FEW:
        method = sized[str(folder / file_name((detector, size)))]
        assert method.title == f'{size} words'
        make(method.factory, method.options)  # refuses a vocabulary of another detector
