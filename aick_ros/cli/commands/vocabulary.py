# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick vocabulary``: learns visual words for the fast search from recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from aick_ros.borders.names import counted
from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.cli.input.reading import COMPLETE, Reading
from aick_ros.cli.output.console import progress
from aick_ros.cli.output.files import write_whole
from aick_ros.cli.output.target import check_target
from aick_ros.errors import InputError
from aick_ros.features.k_means import ROUNDS, learn_words
from aick_ros.features.vocabulary import Vocabulary
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.settings import Settings
from aick_ros.sources import SourceOptions, open_source

Sources = Annotated[list[str], typer.Argument(
    metavar='SOURCE...', show_default=False,
    help='Recordings to learn from, of any format; not those that it will be used on.')]
Out = Annotated[Path, typer.Option(
    '--out', metavar='FILE', show_default=False, help='File of the new vocabulary (.npz).')]
Words = Annotated[int, typer.Option(
    '--words', metavar='N', min=1, max=100000, help='Number of words.')]
Every = Annotated[int, typer.Option(
    '--every', metavar='N', min=1, help='Use every N-th frame; consecutive frames are similar.')]
Seed = Annotated[int, typer.Option(
    '--seed', metavar='N', min=0, help='Seed of the clustering.')]


def vocabulary(sources: Sources, out: Out, words: Words = 1000, every: Every = 10,
               seed: Seed = 0, preset: options.Preset = None, config: options.Config = None,
               assignments: options.Assignments = None,
               register_depth: options.RegisterDepth = False,
               depth_info_topic: options.DepthInfoTopic = None,
               depth_in_colour: options.DepthInColour = None,
               limit: options.Limit = None) -> int:
    """
    Learn a vocabulary of visual words for the fast search (aick.vocabulary).

    The keypoints are those of the odometry with the same parameters: for a vocabulary of SURF,
    give --set features.detector=surf. The file appears when it is complete; Ctrl-C leaves no file
    behind.
    """
    settings = options.settings_from(preset, config, assignments)
    source_options = SourceOptions(
        register_depth=register_depth, depth_info_topic=depth_info_topic,
        depth_in_colour=depth_in_colour)
    check_target(str(out), *sources, config)
    damage, descriptors = DamageLog(), []
    for source in sources:
        reading = Reading(open_source(source, source_options), limit, damage)
        descriptors += _descriptors(reading, every, settings)
        if reading.ended != COMPLETE:
            raise InputError(f'{source}: {reading.ended}')
    if not descriptors:
        raise InputError(f'{", ".join(sources)} has no usable frame')
    with progress('clustering', ROUNDS, 'rounds') as show:
        centres = learn_words(np.concatenate(descriptors), words, seed, ROUNDS, show)
    learned = Vocabulary(settings.features.detector, centres,
                         f'{counted(len(descriptors), "frame")} of {", ".join(sources)}')
    write_whole(out, learned.to_bytes())
    count = sum(map(len, descriptors))
    typer.echo(f'{words} words of {count} {settings.features.detector} keypoints, '
               f'{counted(len(descriptors), "frame")}, in {out}')
    return outcome.of_reading(reading)


def _descriptors(reading: Reading, every: int, settings: Settings) -> list[np.ndarray]:
    """Return the descriptors of each frame that is used."""
    extractor = KeypointExtractor(settings.features, settings.sensor)
    found = []
    with progress(reading.name, len(reading)) as show:
        for index, frame in enumerate(reading.frames(reading.damage)):
            if index % every == 0:
                found.append(extractor.extract(frame).descriptors)
            show(index + 1)
    return found
