# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Presets against the parameters of the paper (IV, V-A)."""

from dataclasses import replace

import pytest

from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values, with_values
from aick_ros.settings.presets import PRESETS, preset


def test_orb_presets_are_those_of_the_paper():
    full, fast = preset('paper-full'), preset('paper-fast')
    assert (full.aick.alpha, full.aick.iterations, full.features.max_keypoints) == (0.8, 25, 0)
    assert (fast.aick.alpha, fast.aick.iterations, fast.features.max_keypoints) == (0.6, 10, 350)
    for settings in (full, fast):
        assert (settings.aick.lambda_e, settings.aick.lambda_f) == (0.01, 0.2)
        assert settings.features.detector == 'orb'
        assert settings.features.cell_size == 0.0  # the strongest of the whole image
        orb = settings.features.orb
        assert orb.min_fast_threshold == orb.fast_threshold  # weaker corners are not the paper's
        assert replace(orb, min_fast_threshold=5) == Settings().features.orb


def test_surf_presets_are_those_of_the_paper():
    full, fast = preset('paper-full-surf'), preset('paper-fast-surf')
    assert (full.aick.alpha, full.aick.iterations, full.features.max_keypoints) == (0.8, 25, 0)
    assert (fast.aick.alpha, fast.aick.iterations, fast.features.max_keypoints) == (0.3, 5, 200)
    for settings in (full, fast):
        assert (settings.aick.lambda_e, settings.aick.lambda_f) == (0.01, 0.2)
        assert settings.features.detector == 'surf'
        assert settings.features.cell_size == 0.0
        surf = settings.features.surf
        assert (surf.octaves, surf.intervals, surf.init_sample, surf.threshold) == (5, 5, 2, 1e-5)


def test_presets_with_words_differ_from_the_others_by_the_vocabulary_only():
    for name, detector in (('paper-fast', 'orb'), ('paper-fast-surf', 'surf')):
        with_words, without = preset(f'{name}-words'), preset(name)
        assert with_words.aick.vocabulary == f'{detector}-1000'
        assert with_values(with_words, {'aick.vocabulary': '',
                                        'aick.word_radius': without.aick.word_radius}) == without
    for name in ('paper-fast-words', 'paper-fast-surf-words'):
        assert preset(name).aick.word_radius == 0.26


@pytest.mark.parametrize('name', [name for name in PRESETS if name.startswith('paper-')])
def test_presets_of_the_paper_have_no_refinement_and_register_to_the_previous_frame(name):
    assert preset(name).refinement.mode == 'none'
    assert preset(name).odometry.reference == 'previous'


def test_embedded_tracks_between_registrations_by_aick():
    settings = preset('embedded')
    assert settings.odometry.aick_interval == 10
    assert settings.refinement.mode == 'joint'  # tracking is part of the refinement
    assert settings.aick == Settings().aick
    assert Settings().odometry.aick_interval == 1


def test_an_unknown_preset_is_rejected_with_the_list_of_presets():
    with pytest.raises(InputError, match='paper-full, paper-fast'):
        preset('paper')


@pytest.mark.parametrize('name', PRESETS)
def test_a_preset_changes_what_it_names_and_nothing_else(name):
    given, found, default = PRESETS[name], values(preset(name)), values(Settings())
    assert {key for key in found if found[key] != default[key]} <= set(given) <= set(found)
    assert {key: found[key] for key in given} == dict(given)


@pytest.mark.parametrize('name', [name for name in PRESETS if name.startswith('paper-')])
def test_presets_of_the_paper_have_no_prior_of_the_motion(name):
    assert not preset(name).odometry.motion_prior


def test_embedded_computes_less_than_the_default():
    small, default = values(preset('embedded')), values(Settings())
    for name in ('features.max_keypoints', 'features.orb.nfeatures', 'features.orb.levels',
                 'refinement.max_tracks', 'odometry.min_overlap'):
        assert small[name] < default[name]


def test_embedded_has_the_pyramid_of_the_default_in_half_the_levels():
    """Every second one: 1.2 squared, so that the coarsest level is about the same."""
    small, default = preset('embedded').features.orb, Settings().features.orb
    assert small.levels == default.levels // 2
    assert small.scale_factor == pytest.approx(default.scale_factor ** 2)


def test_the_sentence_names_the_unknown_preset():
    with pytest.raises(InputError) as raised:
        preset('fast')
    assert str(raised.value) == f"unknown preset 'fast': the presets are {', '.join(PRESETS)}"
