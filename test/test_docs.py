# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""README, docs and config say what the code says; each page is one click from the README."""

import ast
import re
import runpy
from pathlib import Path

import pytest

from aick_ros.cli import main
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values

ROOT = Path(__file__).parents[1]
README = (ROOT / 'README.md').read_text()
PAGES = {page.name: page.read_text() for page in sorted((ROOT / 'docs').glob('*.md'))}
GENERATED = runpy.run_path(str(ROOT / 'tools' / 'write_docs.py'))
REMEDY = 'run tools/write_docs.py'
CONCEPTS = 'architecture.md', 'learned_errors.md', 'expected_motion.md'
LONGEST_CONCEPT = 450  # characters
LONGEST_SENTENCE = 30  # words, or a part of one up to a colon or semicolon


def strings_of(file):
    """Return the texts in a file, ... in place of each value that is formatted into them."""
    tree = ast.parse(file.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value
        elif isinstance(node, ast.JoinedStr):
            yield ''.join(part.value if isinstance(part, ast.Constant) else '...'
                          for part in node.values)


@pytest.fixture(scope='module')
def messages():
    return '\n'.join(text for file in (ROOT / 'aick_ros').rglob('*.py')
                     for text in strings_of(file))


def test_the_readme_is_short():
    assert len(README.splitlines()) <= 160


@pytest.mark.parametrize('page', PAGES)
def test_each_page_is_one_click_from_the_readme(page):
    assert re.search(rf'\]\(docs/{page}[)#]', README)


def test_the_library_page_is_that_of_the_docstrings():
    assert PAGES['api.md'] == GENERATED['api_page'](), REMEDY


def test_the_library_page_has_every_public_name():
    assert sorted(name for names in GENERATED['GROUPS'].values() for name in names) == sorted(
        set(GENERATED['aick_ros'].__all__) - {'__version__'})


def test_the_parameter_tables_are_those_of_the_settings():
    assert PAGES['parameters.md'] == GENERATED['parameters_page'](), REMEDY
    for group in (GENERATED['Settings'](), GENERATED['NodeSettings']()):
        assert GENERATED['parameter_table'](group) in PAGES['parameters.md']


@pytest.mark.parametrize('page', sorted({*PAGES} - {'api.md'}))  # which has names of Python
def test_a_parameter_that_a_page_names_exists(page):
    names = set(values(Settings()))
    groups = '|'.join({name.partition('.')[0] for name in names if '.' in name})
    found = set(re.findall(rf'`((?:{groups})\.\w+)(?:[`=:]| )', PAGES[page]))
    assert {name for name in found if not name.endswith('.py')} <= names


def test_the_configuration_is_what_the_command_prints():
    assert (ROOT / 'config' / 'odom_node.yaml').read_text() == GENERATED['node_file'](), REMEDY


def test_every_command_and_option_named_exists(capfd):
    commands = set(re.findall(r'^\| `aick (\w+)', PAGES['command.md'], re.MULTILINE))
    folder = ROOT / 'aick_ros' / 'cli' / 'commands'
    assert commands == {file.stem for file in folder.glob('[a-z]*.py')}
    for command in ('evaluate', 'compare', 'view', 'benchmark', 'simulate', 'vocabulary'):
        with pytest.raises(SystemExit) as end:
            main([command, '--help'])
        assert end.value.code == 0
    options = capfd.readouterr().out
    for option in re.findall(r'--[a-z]+', PAGES['command.md']):
        assert option in options + '--help --gaps', option


@pytest.mark.parametrize('row', re.findall(r'^\| `(.+?)` \|', PAGES['troubleshooting.md'],
                                           re.MULTILINE))
def test_each_message_explained_is_one_of_the_code(row, messages):
    pattern = r'[^\n]*'.join(re.escape(part) for part in row.split('...'))
    assert re.search(pattern, messages)


def test_each_camera_is_named():
    for file in (ROOT / 'config' / 'cameras').glob('*.yaml'):
        assert re.search(rf'\b{file.stem}\b', README)
        assert f'| `{file.stem}` |' in PAGES['cameras.md']


def test_the_speed_in_the_readme_is_that_of_its_page():
    stated = re.search(r'A frame takes (\S+) of the processor time of cv2.Odometry on depth',
                       README)
    measured = re.search(r'^\| the default, by cv2.Odometry on depth \| (\S+) \|$',
                         PAGES['performance.md'], re.MULTILINE)
    assert float(stated[1]) == float(measured[1])


@pytest.mark.parametrize('page', CONCEPTS)
def test_each_concept_is_a_short_paragraph(page):
    paragraphs = [text for text in PAGES[page].split('\n\n') if text.startswith('**')]
    assert paragraphs
    for paragraph in paragraphs:
        assert len(paragraph) <= LONGEST_CONCEPT, paragraph
        for sentence in re.split(r'[.;:]\s', paragraph):
            assert len(sentence.split()) <= LONGEST_SENTENCE, sentence


@pytest.mark.parametrize('page', [*(f'docs/{page}' for page in CONCEPTS), 'CONTRIBUTING.md'])
def test_files_and_folders_named_exist(page):
    text = (ROOT / page).read_text()
    for place in re.findall(r'`([\w/]+/(?:\w+\.\w+)?)[^`]*`', text):
        assert any((folder / place).exists() for folder in (ROOT, ROOT / 'aick_ros')), place
    names = {file.name for folder in ('aick_ros', 'test', 'tools') for file in
             (ROOT / folder).rglob('*.py')} | {'setup.py'}
    assert set(re.findall(r'`(\w+\.py)`', text)) <= names


def test_imports_run_downwards_in_the_picture():
    picture = re.search(r'```text\n(.*?)```', PAGES['architecture.md'], re.DOTALL)[1]
    rows = {name: row for row, line in enumerate(picture.splitlines())
            for name in re.findall(r'\w+', line)}
    imports = runpy.run_path(str(ROOT / 'test' / 'test_house.py'))['IMPORTS']
    assert set(rows) == set(imports)
    for room, allowed in imports.items():
        assert all(rows[other] > rows[room] for other in allowed.split() if other != '_kernels')


def test_each_folder_has_its_sentence():
    folders = {file.parent.name for file in (ROOT / 'aick_ros').glob('*/__init__.py')}
    assert set(re.findall(r'^\| `(\w+)/` \|', PAGES['architecture.md'], re.MULTILINE)) == folders


def test_the_library_example_runs(capfd):
    example = re.search(r'```python\n(.*?)```', README, re.DOTALL).group(1)
    short = example.replace("open_source('synthetic:1').frames()",
                            "[next(open_source('synthetic:1').frames())]")
    assert short != example
    exec(short, {})
    assert capfd.readouterr().out.startswith('FIRST_FRAME')


@pytest.mark.parametrize('page', [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md',
                                  *(ROOT / 'docs').glob('*.md')], ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target, anchor in re.findall(r'\]\(([^)#:]*)(?:#([^)]*))?\)', page.read_text()):
        file = page.parent / target if target else page
        assert file.exists(), target
        if anchor:
            titles = re.findall(r'^#+ (.*)$', file.read_text(), re.MULTILINE)
            assert anchor in {re.sub(r'[^\w\- ]', '', title.lower()).replace(' ', '-')
                              for title in titles}, anchor
