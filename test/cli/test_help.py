# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What --help says of each argument and option, against its name, kind and default."""

import inspect
import re
import typing
from pathlib import Path

import pytest
import typer

from aick_ros.cli.app import app

COMMANDS = typer.main.get_command(app).commands
OPTIONS = [(name, option) for name, command in COMMANDS.items() for option in command.params
           if option.name != 'help']
IDS = [f'{name} {option.opts[0]}' for name, option in OPTIONS]

KINDS = {'N': int, 'SECONDS': float, 'HZ': float, 'FACTOR': float, 'TOPIC': str, 'BYTES': str,
         'NAME': str, 'DIR': Path, 'FILE.rrd': Path, 'OUT': Path, 'N,N,...': str,
         'NAME,NAME,...': str, 'WIDTHxHEIGHT': str, 'tcp://HOST:PORT': str,
         'X Y Z QX QY QZ QW': tuple, 'NAME=VALUE': list, 'NAME=VALUE,VALUE,...': list,
         'FROM:=TO': list, 'SOURCE...': list, 'RUN RUN...': list, 'SOURCE': str, '[SOURCE]': str,
         '[SOURCE|RUN]': str}

WORDS = {
    '--preset': 'parameters of the paper', '--config': 'parameter file', '--set': 'one parameter',
    '--camera': 'calibration', '--colour-topic': 'colour images',
    '--depth-topic': 'depth images', '--info-topic': 'calibration of the colour camera',
    '--ground-truth-topic': 'true poses', '--max-interval': 'between the stamps',
    '--register-depth': 'register them to colour',
    '--depth-info-topic': 'calibration of the depth camera',
    '--depth-in-colour': 'depth camera in the colour camera', '--limit': 'after n frames',
    '--json': 'results as json', '--gaps': 'distances, in frames', '--export': 'estimate.square',
    '--list': 'one per line', '--vary': 'each value', '--workers': 'number of processes',
    '--memory-limit': 'memory of a process', '--time-limit': 'longest time',
    '--scheduler': 'scheduler of an existing', '--dashboard': "dask's pages",
    '--scratch-limit': 'most bytes that', '--fail-on-regression': 'exit with 3',
    '--live': 'running odom_node', '--namespace': 'of the node', '--remap': 'rule of remapping',
    '--save': 'write a file', '--web': 'to a browser', '--methods': 'methods to compare',
    '--mask': 'hides a part',
    '--corridor': 'number of frames', '--jobs': 'number of methods', '--pairs': 'number of pairs',
    '--frames': 'number of frames', '--seed': 'seed of the', '--size': 'in pixels',
    '--perfect': 'without noise', '--storage': 'storage of the bag',
    '--depth-encoding': 'rounds it to millimetres', '--words': 'number of words',
    '--every': 'every n-th', '--imu-topic': 'topic of the imu', '--plots': 'folder for',
    '--rate': ('frames per second', 'speed of the playback'),
    '--format': ('bag in mcap', 'parameter file'),
    '--imu': ('samples of an imu', 'noise of the imu'),
    '--out': ('folder', 'html page', 'new vocabulary')}


def kind_of(name, option):
    """Return the type that the function of a command declares."""
    hint = typing.get_type_hints(COMMANDS[name].callback)[option.name]
    kinds = [kind for kind in typing.get_args(hint) or (hint,) if kind is not type(None)]
    return typing.get_origin(hint) if typing.get_origin(hint) in (tuple, list) else (
        typing.get_origin(kinds[0]) or kinds[0])


@pytest.mark.parametrize('name, option', OPTIONS, ids=IDS)
def test_it_is_explained_in_sentences_that_name_what_it_is_for(name, option):
    assert re.match(r'[A-Z0-9].*\.$', option.help), option.help
    if option.opts[0].startswith('--'):
        words = WORDS[option.opts[0]]
        assert any(each in option.help.lower()
                   for each in ([words] if isinstance(words, str) else words)), option.help


@pytest.mark.parametrize('name, option', OPTIONS, ids=IDS)
def test_its_value_is_of_the_kind_that_it_shows(name, option):
    kind = kind_of(name, option)
    if kind is bool:
        assert option.is_flag and option.metavar is None
    elif option.metavar == 'FILE':  # of results also - for standard output
        assert kind is (str if option.opts[0] == '--json' else Path)
    elif option.metavar is None or '|' in option.metavar and option.metavar[0] != '[':
        assert option.opts[0] in ('--format', '--imu', '--preset', '--storage',
                                  '--depth-encoding')
    else:
        assert kind is KINDS[option.metavar]


@pytest.mark.parametrize('name, option', OPTIONS, ids=IDS)
def test_its_default_is_shown_where_there_is_one(name, option):
    default = inspect.signature(COMMANDS[name].callback).parameters[option.name].default
    has_default = default not in (None, '', inspect.Parameter.empty)
    assert bool(option.show_default) == has_default


@pytest.mark.parametrize('option', sorted({option.opts[0] for _, option in OPTIONS}))
def test_commands_that_share_an_option_explain_it_alike(option):
    """Those whose meaning depends on the command are few."""
    texts = {each.help for _, each in OPTIONS if each.opts[0] == option}
    if option not in ('source', 'sources', 'out', '--out', '--plots', '--frames', '--seed',
                      '--rate', '--format', '--imu', '--time-limit'):
        assert len(texts) == 1


@pytest.mark.parametrize('name', COMMANDS)
def test_a_command_says_in_a_sentence_what_it_does(name):
    first = COMMANDS[name].help.strip().split('\n')[0]
    assert re.match(r'[A-Z].*\.$', first)
