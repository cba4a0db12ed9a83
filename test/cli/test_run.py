# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sentences and exit codes for everything that can go wrong."""

import errno
import functools
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import aick_ros.cli
from aick_ros.cli.commands import replay as replay_module

ROOT = Path(__file__).parents[2]

SIGNALLED = """
import os, signal, sys
class Finder:
    def find_spec(self, name, *_):
        if name == "aick_ros.cli.run":
            os.kill(os.getpid(), signal.{ending})
sys.meta_path.insert(0, Finder())
from aick_ros.cli import main
main(["--version"])
"""


def fail_with(error):
    def open_source(*_, **__):
        raise error
    return open_source


def python(code, *arguments):
    return subprocess.run([sys.executable, '-c', code, *arguments], capture_output=True,
                          text=True, env={**os.environ, 'PYTHONPATH': str(ROOT)}, check=False)


@pytest.mark.parametrize('arguments', [['--help'], [], ['replay', '--help']])
def test_help(aick, arguments):
    outcome = aick(*arguments)
    assert outcome.code == 0
    assert 'Usage: aick' in outcome.out
    assert outcome.err == ''


def test_version(aick):
    outcome = aick('--version')
    assert (outcome.code, outcome.out) == (0, f'aick {aick_ros.__version__}\n')


def test_a_command_does_not_import_what_others_need():
    ended = python('import sys; from aick_ros.cli.run import run; run(["parameters"]); '
                   'sys.exit(str({"rosbags", "matplotlib", "dask", "aick_ros.odometry"} '
                   '& set(sys.modules)))')
    assert ended.stderr == 'set()\n'


@pytest.mark.parametrize('arguments, words', [
    (['replay'], ['SOURCE', 'aick replay --help']),
    (['repaly', 'x'], ["No such command 'repaly'. Did you mean 'replay'? See aick --help"]),
    (['replay', 'x', '--colour', 'y'], ['--colour']),
    (['replay', 'x', '--limit', '0'], ['--limit']),
    (['replay', 'x', '--limit', 'many'], ['--limit']),
    (['simulate', 'x', '--format', 'zip'], ['--format', 'zip'])])
def test_usage_errors_are_one_line(aick, arguments, words):
    outcome = aick(*arguments)
    assert outcome.code == 2
    assert all(word in outcome.sentence for word in words)
    assert outcome.out == ''


@pytest.mark.parametrize('command', [['replay'], ['evaluate'], ['convert']])
@pytest.mark.parametrize('make, words', [
    (lambda folder: None, 'does not exist'),
    (lambda folder: folder.mkdir(), 'is empty'),
    (lambda folder: folder.write_bytes(b'nonsense'), 'not a known kind of recording')])
def test_sources_that_are_none(aick, tmp_path, command, make, words):
    make(tmp_path / 'source')
    outcome = aick(*command, tmp_path / 'source', *(['out'] if command == ['convert'] else []))
    assert outcome.code == 2
    assert str(tmp_path / 'source') in outcome.sentence
    assert words in outcome.sentence
    assert [path.name for path in tmp_path.iterdir() if path.name != 'source'] == []


@pytest.mark.parametrize('arguments, words', [
    (['--set', 'aick.apha=1'], 'did you mean aick.alpha'),
    (['--preset', 'best'], "unknown preset 'best'"),
    (['--config', 'none.yaml'], 'cannot read the settings none.yaml'),
    (['--camera', 'none.json'], 'none.json'),
    (['--json', 'none/figures.json'], 'the folder none does not exist')])
def test_options_that_do_not_fit(aick, tmp_path, arguments, words):
    (tmp_path / 'recording').mkdir()
    (tmp_path / 'recording' / 'rgb.txt').write_text('1.0 rgb/1.png\n')
    (tmp_path / 'recording' / 'depth.txt').write_text('1.0 depth/1.png\n')
    outcome = aick('replay', 'recording', *arguments)
    assert outcome.code == 2
    assert words in outcome.sentence
    assert not (tmp_path / 'runs').exists()


@pytest.mark.parametrize('gaps', ['', '0', '1,x', '5,-1', '1.5', '1,1' + 23 * '0'])
def test_gaps_that_are_none(aick, gaps):
    outcome = aick('evaluate', 'synthetic:1', '--gaps', gaps)
    assert outcome.code == 2
    assert '--gaps' in outcome.sentence


def test_the_home_folder_is_filled_in_where_no_shell_does(aick, tmp_path, monkeypatch):
    """As in --json=~/x; a folder of that name would be made, which to remove is dangerous."""
    monkeypatch.setenv('HOME', str(tmp_path / 'home'))
    (tmp_path / 'home').mkdir()
    outcome = aick('simulate', 'room', '--frames', '1', '--format', 'tum')
    assert outcome.code == 0
    outcome = aick('replay', 'room', '--limit', '1', '--out=~/runs', '--json=~/x.json')
    assert outcome.code == 0
    assert sorted(os.listdir(tmp_path)) == ['home', 'room']
    assert {'runs', 'x.json'} <= set(os.listdir(tmp_path / 'home'))


def test_a_defect_is_ours_and_leaves_a_file_to_report(aick, monkeypatch, tmp_path):
    monkeypatch.setattr(replay_module, 'open_source', fail_with(ZeroDivisionError('by zero')))
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    outcome = aick('replay', 'x')
    assert outcome.code == 1
    assert 'a defect of aick (ZeroDivisionError: by zero)' in outcome.sentence
    file = Path(re.search(r'\S+\.txt', outcome.sentence).group())
    text = file.read_text()
    assert text.startswith('aick replay x\n')
    assert 'Traceback' in text
    assert aick_ros.__version__ in text


def test_a_defect_is_shown_on_request(aick, monkeypatch, tmp_path):
    monkeypatch.setattr(replay_module, 'open_source', fail_with(ZeroDivisionError('by zero')))
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    outcome = aick('replay', 'x', '--traceback')
    assert outcome.code == 1
    assert 'Traceback' in outcome.err
    assert list(tmp_path.iterdir()) == []


def test_a_defect_that_cannot_be_written_is_shown(aick, monkeypatch):
    monkeypatch.setattr(replay_module, 'open_source', fail_with(ZeroDivisionError('by zero')))
    monkeypatch.setattr('tempfile.NamedTemporaryFile', fail_with(FileNotFoundError('/tmp')))
    outcome = aick('replay', 'x')
    assert outcome.code == 1
    assert 'Traceback' in outcome.err and 'report it with the text above' in outcome.err


def test_the_report_of_a_defect_is_readable_by_its_owner_alone(aick, monkeypatch, tmp_path):
    monkeypatch.setattr(replay_module, 'open_source', fail_with(ZeroDivisionError('by zero')))
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    aick('replay', 'x')
    (file,) = tmp_path.glob('aick-traceback-*')
    assert file.stat().st_mode & 0o777 == 0o600


def test_names_reach_the_terminal_harmlessly(aick):
    outcome = aick('replay', 'a\x1b[31m\x07b')
    assert outcome.code == 2
    assert r'a\x1b[31m\x07b does not exist' in outcome.err
    assert '\x1b' not in outcome.err


@pytest.mark.parametrize('command', [
    ('replay', ' '), ('compare', ' ', 'x'), ('fleet', ''),
    ('benchmark', '\t', '--methods', 'aick')])
def test_names_that_cannot_be_seen_are_quoted(aick, command):
    outcome = aick(*command)
    assert outcome.code == 2
    assert outcome.sentence.startswith(repr(command[1]))


@pytest.mark.parametrize('environment, code, redirect', [
    ({'PYTHONIOENCODING': 'ascii'}, 'print("größe")', ''),
    ({'MPLBACKEND': 'nonsense'}, 'import matplotlib', ''),
    ({'MPLCONFIGDIR': '/proc/none'}, 'import matplotlib', ''),
    ({'MATPLOTLIBRC': '/dev/null'}, 'import os; assert "MATPLOTLIBRC" not in os.environ', ''),
    ({'COLUMNS': '²', 'LINES': '²'}, 'pass', ''),
    ({'OPENCV_CPU_DISABLE': 'x'}, 'pass', ''), ({'NUMPY_MADVISE_HUGEPAGE': 'x'}, 'pass', ''),
    ({'OMP_NUM_THREADS': '4,3'}, 'import os; int(os.environ.get("OMP_NUM_THREADS", 1))', ''),
    ({'SOURCE_DATE_EPOCH': 'x'}, 'import os; int(os.environ.get("SOURCE_DATE_EPOCH", 0))', ''),
    ({'ARROW_DEFAULT_MEMORY_POOL': '\x1b'}, 'import pyarrow; pyarrow.array([1])', ''),
    ({'RERUN_STRICT': 'x', 'TOKIO_WORKER_THREADS': '0'}, 'import rerun', ''),
    ({'LC_ALL': '\x1b[31m', 'MPLCONFIGDIR': '.'}, 'import matplotlib.font_manager', ''),
    ({}, 'pass', '2>&-'), ({}, 'pass', '2>/dev/full')])
def test_odd_environments_are_no_defects(tmp_path, environment, code, redirect):
    command = (f'from aick_ros.cli import main; import sys\ntry:\n'
               f' main(["replay", "größe"])\nfinally:\n {code}')
    process = subprocess.run(
        ['sh', '-c', f'exec "$0" -c "$1" {redirect}', sys.executable, command], cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': str(ROOT), **environment}, capture_output=True)
    assert process.returncode == 2, process.stderr
    assert b'Traceback' not in process.stderr
    assert process.stderr.count(b'\n') <= 1


@pytest.mark.parametrize('number', [errno.ENOSPC, errno.EMFILE, errno.ENOMEM])
def test_full_resources_are_no_defect(aick, monkeypatch, number):
    error = OSError(number, os.strerror(number), 'runs/x')
    monkeypatch.setattr(replay_module, 'open_source', fail_with(error))
    outcome = aick('replay', 'x')
    assert outcome.code == 2
    assert outcome.sentence == f'runs/x: {os.strerror(number)}'


@pytest.mark.parametrize('redirect', ['>/dev/full', '2>/dev/full', '>/dev/full 2>/dev/full'])
@pytest.mark.parametrize('arguments, code', [('parameters', 0), ('replay none', 2)])
def test_an_output_that_cannot_be_written_adds_no_lines(redirect, arguments, code):
    process = subprocess.run(
        f'exec {sys.executable} -m aick_ros {arguments} {redirect}', shell=True,
        capture_output=True, text=True, env={**os.environ, 'PYTHONPATH': str(ROOT)}, check=False)
    is_lost = redirect.startswith('>') and code == 0
    assert process.returncode == (2 if is_lost else code)
    assert process.stderr.count('\n') == (not redirect.endswith('2>/dev/full') and (
        is_lost or code == 2))


@pytest.mark.parametrize('arguments', ['replay ../tum', 'noise ../tum', 'convert ../tum out'])
def test_a_current_folder_that_was_removed_is_no_defect(tmp_path, arguments):
    (tmp_path / 'tum').mkdir()
    for kind in ('rgb', 'depth'):
        (tmp_path / 'tum' / f'{kind}.txt').write_text(f'1.0 {kind}/1.png\n')
    process = subprocess.run(
        f'mkdir gone; cd gone; rmdir ../gone; exec {sys.executable} -m aick_ros {arguments}',
        shell=True, cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert process.returncode == 2
    assert process.stderr == ('aick: the current folder has been removed: change to one that '
                              'exists\n')


@pytest.mark.parametrize('error', ['MemoryError', 'ImportError("x.so: failed to map segment")'])
def test_an_import_without_memory_is_no_defect(error):
    process = python(SIGNALLED.replace('os.kill(os.getpid(), signal.{ending})', f'raise {error}'))
    assert process.returncode == 2
    assert process.stderr.startswith('aick: the memory is full, or limited (ulimit)')
    assert process.stderr.count('\n') == 1


def test_an_input_that_vanishes_is_no_defect(aick, monkeypatch):
    monkeypatch.setattr(replay_module, 'open_source', fail_with(
        FileNotFoundError(2, 'No such file or directory', 'bag/a.mcap')))
    outcome = aick('replay', 'x')
    assert outcome.code == 2
    assert outcome.sentence == 'bag/a.mcap: No such file or directory: was it removed meanwhile?'


@pytest.mark.parametrize('error', [
    MemoryError(), RuntimeError("can't start new thread"),
    ImportError('x.so: failed to map segment from shared object')])
def test_full_memory_is_no_defect(aick, monkeypatch, error):
    monkeypatch.setattr(replay_module, 'open_source', fail_with(error))
    outcome = aick('replay', 'x')
    assert outcome.code == 2
    assert outcome.sentence.startswith('the memory is full, or limited (ulimit)')


@pytest.mark.usefixtures('terminal')
@pytest.mark.parametrize('ending', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interruption_before_anything_is_begun(aick, monkeypatch, tmp_path, ending):
    before = signal.getsignal(ending)
    monkeypatch.setattr(replay_module, 'open_source', lambda *_: signal.raise_signal(ending))
    outcome = aick('replay', 'x')
    assert (outcome.code, outcome.sentence) == (130, 'interrupted')
    assert list(tmp_path.iterdir()) == []
    assert signal.getsignal(ending) is before


@pytest.mark.parametrize('missing, command', [
    ('typer', '--version'), ('rich', '--version'), ('yaml', 'evaluate')])
def test_missing_packages_are_named(missing, command):
    process = python(f'import sys; sys.modules["{missing}"] = None\n'
                     f'from aick_ros.cli import main; main(["{command}"])')
    assert process.returncode == 2
    assert process.stderr == (f"aick: the command needs {missing}: pip install '.[cli]' in the "
                              'folder of aick_ros\n')


def test_the_command_starts_without_packages_that_few_commands_need():
    process = python("""
import sys
sys.modules.update(dict.fromkeys(['matplotlib', 'dask', 'distributed', 'pyarrow', 'rerun']))
from aick_ros.cli import main
main(['--help'])
""")
    assert (process.returncode, process.stderr) == (0, '')
    assert 'parameters' in process.stdout


def test_a_closed_pipe_is_no_defect():
    process = subprocess.run(
        f'{sys.executable} -m aick_ros parameters | true; echo ${{PIPESTATUS[0]}}', shell=True,
        executable='/bin/bash', capture_output=True, text=True, check=False,
        env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert process.stdout.strip() in ('0', '141')
    assert process.stderr == ''


@pytest.mark.usefixtures('terminal')
@pytest.mark.parametrize('ending', ['SIGINT', 'SIGTERM', 'SIGHUP'])
def test_an_interruption_of_the_start_is_one_line(ending):
    process = python(SIGNALLED.format(ending=ending))
    assert (process.returncode, process.stderr) == (130, 'aick: interrupted\n')


@pytest.mark.usefixtures('terminal')
@pytest.mark.parametrize('ending', ['SIGINT', 'SIGTERM', 'SIGHUP'])
def test_a_signal_while_the_environment_is_prepared(ending):
    process = python('import os, signal, sys\n'
                     'from aick_ros import cli\n'
                     f'cli.remove_unusable = lambda: os.kill(os.getpid(), signal.{ending})\n'
                     'cli.main(["--version"])')
    assert (process.returncode, process.stderr) == (130, 'aick: interrupted\n')


@pytest.mark.parametrize('command', [
    ['-m', 'aick_ros'], [str(Path(sys.executable).with_name('aick'))]], ids=['module', 'script'])
def test_an_interruption_while_the_module_is_imported(tmp_path, command):
    (tmp_path / 'sitecustomize.py').write_text("""
import sys
class Finder:
    def find_spec(self, name, *_):
        if name == 'aick_ros.cli':
            raise KeyboardInterrupt
sys.meta_path.insert(0, Finder())
""")
    process = subprocess.run(
        [sys.executable, *command, '--version'], capture_output=True, text=True,
        check=False, env={**os.environ, 'PYTHONPATH': f'{tmp_path}:{ROOT}'})
    assert (process.returncode, process.stderr) == (130, 'aick: interrupted\n')


@pytest.mark.usefixtures('terminal')
@pytest.mark.parametrize('ending', ['SIGINT', 'SIGTERM', 'SIGHUP'])
def test_a_signal_while_the_process_ends_changes_nothing(ending):
    """Also where another thread could get it."""
    process = python('import atexit, os, signal, sys, threading, time\n'
                     'threading.Thread(target=time.sleep, args=(1,)).start()\n'
                     f'atexit.register(os.kill, os.getpid(), signal.{ending})\n'
                     'sys.argv = ["aick", "replay", "none"]\n'
                     'from aick_ros.cli import main; main()')
    assert process.returncode == 2
    assert process.stderr.count('\n') == 1


def test_after_nohup_the_end_of_the_terminal_is_ignored():
    process = python('import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)'
                     + SIGNALLED.format(ending='SIGHUP'))
    assert (process.returncode, process.stderr) == (0, '')


def test_as_a_module_it_has_the_exit_code_of_an_interruption(tmp_path):
    """Also where it came while Python ran code from text, as for a dataclass."""
    (tmp_path / 'sitecustomize.py').write_text('''
import sys
import aick_ros.cli

def interrupted():
    try:
        exec('raise KeyboardInterrupt')
    except KeyboardInterrupt:
        sys.exit(130)

aick_ros.cli.main = interrupted
''')
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get('PYTHONPATH')])])
    run = subprocess.run([sys.executable, '-m', 'aick_ros'],
                         env={**os.environ, 'PYTHONPATH': path})
    assert run.returncode == 130


@functools.cache
def message(columns, *arguments):
    """Return what the command says in a terminal of a width."""
    return subprocess.run(
        [sys.executable, '-m', 'aick_ros', *arguments], capture_output=True, text=True,
        check=False, env={**os.environ, 'PYTHONPATH': str(ROOT), 'COLUMNS': columns}).stderr


@pytest.mark.parametrize('columns', ['0', '2', '²', '9' * 30])
@pytest.mark.parametrize('arguments', [('replay', 'none'), ('none', '--limit')])
def test_nothing_is_lost_at_an_impossible_width(columns, arguments):
    assert message(columns, *arguments) == message('80', *arguments) != ''


def test_descriptors_of_closed_streams_are_given_to_no_file(tmp_path):
    command = ('from aick_ros.cli import main; import os\ntry:\n main(["--version"])\nfinally:\n'
               ' os.system("readlink /proc/self/fd/0 /proc/self/fd/2 > streams")')
    subprocess.run(['sh', '-c', 'exec "$0" -c "$1" 0>&- 1>&- 2>&-', sys.executable, command],
                   cwd=tmp_path, check=False, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert (tmp_path / 'streams').read_text().split() == 2 * ['/dev/null']


def test_a_further_signal_during_the_end_is_not_reported():
    run = python('from aick_ros.cli.input.interruption import endings_interrupt\n'
                 'class Ending:\n def __del__(self):\n  raise KeyboardInterrupt\n'
                 'with endings_interrupt():\n Ending()')
    assert (run.returncode, run.stderr) == (0, '')


@pytest.mark.parametrize('arguments, limit', [
    ('replay none', '-n 15'), ('view none --save view.rrd', '-n 31'), ('replay none', '-d 250000'),
    ('fleet synthetic:1', '-d 450000')])
def test_other_limits_are_one_sentence_too(tmp_path, arguments, limit):
    process = subprocess.run(
        f'ulimit {limit}; exec {sys.executable} -m aick_ros {arguments}', shell=True,
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert process.returncode == 2
    assert re.fullmatch(rf'aick: .*\(ulimit {limit[:2]}\), .* require .*: raise the limit\n',
                        process.stderr)


@pytest.mark.parametrize('arguments, kilobytes', [
    ('simulate out --frames 1 --size 64x48', 400_000), ('replay none', 300_000),
    ('replay none', 500_000), ('fleet synthetic:1', 900_000),
    ('view none --save view.rrd', 2_200_000)])
def test_a_command_with_too_little_is_one_sentence(tmp_path, arguments, kilobytes):
    process = subprocess.run(
        f'ulimit -v {kilobytes}; exec {sys.executable} -m aick_ros {arguments}', shell=True,
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert process.returncode == 2
    assert process.stderr.startswith('aick: the memory of a process is limited to ')
    assert process.stderr.count('\n') == 1


@pytest.mark.parametrize('values', [('1', '2', '3'), ('1', '2', '3', '--limit', '5', 'x', '7')])
def test_an_option_of_several_numbers_says_how_many(aick, values):
    outcome = aick('replay', 'bag', '--depth-in-colour', *values)
    assert outcome.code == 2
    assert outcome.sentence == (
        '--depth-in-colour requires seven numbers, separated by blanks: the position x y z [m] '
        'and the quaternion qx qy qz qw')
