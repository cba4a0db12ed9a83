#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Build a Python package of interfaces for a virtual environment with ROS 2 from the package index.

The wheels of ROS 2 have no tf2_msgs, without which nobody can publish transforms: it is what is
built unless another package is named. They have the generators for messages and services, but
without the CMake around them; this does what CMake would do.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import io
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

DEPENDENCIES = ('builtin_interfaces', 'service_msgs', 'std_msgs', 'geometry_msgs', 'sensor_msgs')

PREFIX = Path(sys.prefix)
SHARE, INCLUDE, LIB = PREFIX / 'share', PREFIX / 'include', PREFIX / 'lib'
SITE_PACKAGES = Path(sysconfig.get_path('purelib'))

C_GENERATOR = 'rosidl_generator_c'
PYTHON_GENERATOR = 'rosidl_generator_py'
TYPE_HASHES = 'rosidl_generator_type_description'
FASTRTPS = 'rosidl_typesupport_fastrtps_c'
INTROSPECTION = 'rosidl_typesupport_introspection_c'
DISPATCH = 'rosidl_typesupport_c'


class BuildError(Exception):
    """The message package cannot be built; the message says why and what to do."""


def check_tools() -> None:
    """
    Look for what the build needs before it starts.

    :raises BuildError: for the first thing that is missing.
    """
    for compiler in ('gcc', 'g++'):
        if shutil.which(compiler) is None:
            raise BuildError(f'there is no {compiler}: install a C and a C++ compiler '
                             '(Debian, Ubuntu: apt install g++)')
    header = Path(sysconfig.get_path('include'), 'Python.h')
    if not header.is_file():
        raise BuildError(f'there is no {header}: install the headers of this Python '
                         '(Debian, Ubuntu: apt install python3-dev)')
    for module in ('rosidl_adapter', C_GENERATOR, PYTHON_GENERATOR, FASTRTPS, 'numpy'):
        if importlib.util.find_spec(module) is None:
            raise BuildError(f'{PREFIX} has no Python package {module}: install aick_ros[ros] '
                             'there and run this with its Python')


@dataclass(frozen=True)
class Package:
    """
    A package of messages and services.

    :param definitions: content by file, ``NAME.msg`` or ``NAME.srv``.
    """

    name: str
    definitions: Mapping[str, str]

    @classmethod
    def of_folder(cls, folder: Path) -> Package:
        """
        Return the package of a folder with its name, from the .msg and .srv files in it.

        :raises BuildError: where there are none.
        """
        definitions = {file.name: file.read_text() for file in sorted(folder.iterdir())
                       if file.suffix in ('.msg', '.srv')}
        if not definitions:
            raise BuildError(f'there are no .msg and no .srv files in {folder}')
        return cls(folder.resolve().name, definitions)


TF2_MSGS = Package('tf2_msgs', {'TFMessage.msg': 'geometry_msgs/TransformStamped[] transforms\n'})


class Generators:
    """
    The code generators of the wheels, each called with the arguments that CMake would give it.

    :param work: folder for all that is generated.
    """

    def __init__(self, package: Package, work: Path) -> None:
        self._package, self._work = package, work
        self.definition_files = self._files('source', None)
        self.idl_files = self._files('idl', '.idl')
        self.hash_files = self._files(TYPE_HASHES, '.json')

    def _files(self, folder: str, suffix: str | None) -> dict[str, Path]:
        """Return the files made of each definition, in the folder of its kind: msg or srv."""
        return {name: self._work / folder / self._package.name / Path(name).suffix[1:]
                / Path(name).with_suffix(suffix or Path(name).suffix)
                for name in self._package.definitions}

    def run(self) -> list[Path]:
        """
        Generate everything.

        :returns: the folders of generated code: C, Fast DDS, introspection, dispatch, Python.
        """
        from rosidl_generator_c import generate_c
        from rosidl_generator_py import generate_py
        from rosidl_generator_type_description import generate_type_hash
        from rosidl_typesupport_c import generate_c as generate_dispatch
        from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c
        from rosidl_typesupport_introspection_c import generate_c as generate_introspection

        self._write_idl()
        self._generate(TYPE_HASHES, generate_type_hash,
                       include_paths=[f'{name}:{SHARE / name}' for name in DEPENDENCIES])
        folders = [
            self._generate(
                C_GENERATOR, generate_c,
                ros_interface_files=[str(file) for file in self.definition_files.values()],
                type_description_tuples=[f'{_in_package(self.idl_files[name])}:{file}'
                                         for name, file in self.hash_files.items()]),
            self._generate(FASTRTPS, generate_typesupport_fastrtps_c),
            self._generate(INTROSPECTION, generate_introspection),
            self._generate(DISPATCH, generate_dispatch, [FASTRTPS, INTROSPECTION]),
            self._generate(PYTHON_GENERATOR, generate_py, [DISPATCH]),
        ]
        for name in (C_GENERATOR, FASTRTPS, INTROSPECTION):
            self._write_visibility_control(name)
        return folders

    def _write_idl(self) -> None:
        from rosidl_adapter.msg import convert_msg_to_idl
        from rosidl_adapter.srv import convert_srv_to_idl

        convert = {'.msg': convert_msg_to_idl, '.srv': convert_srv_to_idl}
        for name, definition in self._package.definitions.items():
            file = self.definition_files[name]
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(definition)
            with contextlib.redirect_stdout(io.StringIO()):
                convert[file.suffix](file.parents[1], self._package.name, _in_package(file),
                                     self.idl_files[name].parent)

    def _generate(self, name: str, generator: Callable[..., Any], *arguments: Any,
                  **more: Any) -> Path:
        output = self._work / name / self._package.name
        output.mkdir(parents=True)
        description = self._work / f'{name}.json'
        description.write_text(json.dumps({
            'package_name': self._package.name,
            'idl_tuples': [f'{file.parents[1]}:{_in_package(file)}'
                           for file in self.idl_files.values()],
            'ros_interface_dependencies': [
                f'{dependency}:{path}' for dependency in DEPENDENCIES
                for path in sorted((SHARE / dependency / 'msg').glob('*.idl'))],
            'target_dependencies': [],
            'template_dir': str(SHARE / name / 'resource'),
            'output_dir': str(output),
            **more}))
        generator(str(description), *arguments)
        return output.parent

    def _write_visibility_control(self, name: str) -> None:
        from rosidl_cli.command.helpers import generate_visibility_control_file

        header = f'{name}__visibility_control.h'
        generate_visibility_control_file(
            package_name=self._package.name,
            template_path=SHARE / name / 'resource' / f'{header}.in',
            output_path=self._work / name / self._package.name / 'msg' / header)


def compile_sources(name: str, folders: Sequence[Path]) -> dict[Path, list[str]]:
    """
    Compile every C and C++ file below the folders, each folder seeing the headers of all.

    :param name: of the package.
    :returns: the object files of each folder.
    :raises BuildError: with the compiler's words where one fails.
    """
    includes = [*folders, Path(sysconfig.get_path('include')), _numpy_headers(), INCLUDE,
                *(path for path in INCLUDE.iterdir() if path.is_dir())]
    flags = ['-O2', '-fPIC', '-w', f'-DROS_PACKAGE_NAME="{name}"',
             *(f'-I{path}' for path in includes)]

    def compile_one(source: Path) -> str:
        compiler = ['gcc', '-std=gnu11'] if source.suffix == '.c' else ['g++', '-std=c++17']
        target = f'{source}.o'
        _call([*compiler, *flags, '-c', str(source), '-o', target])
        return target

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = {folder: pool.map(compile_one, _sources(folder)) for folder in folders}
        return {folder: list(targets) for folder, targets in objects.items()}


def link(name: str, objects: dict[Path, list[str]], output: Path) -> None:
    """
    Link the four libraries of the message package.

    :param name: of the package.
    :param objects: of C, Fast DDS, introspection, dispatch and Python, in this order.
    :param output: folder for the libraries.
    """
    c, fastrtps, introspection, dispatch, python = objects.values()
    common = [*_dependency_libraries(C_GENERATOR), _library('rosidl_runtime_c'),
              _library('rcutils')]

    def shared(file: str, files: list[str], libraries: list[str]) -> str:
        target = str(output / file)
        _call(['g++', '-shared', f'-Wl,-soname,{file}', '-Wl,-rpath,$ORIGIN', '-o', target,
               *files, '-Wl,--as-needed', *libraries, *common])
        return target

    message = shared(f'lib{name}__{C_GENERATOR}.so', c, [])
    over_dds = shared(f'lib{name}__{FASTRTPS}.so', fastrtps, [
        message, *_dependency_libraries(FASTRTPS), _library(FASTRTPS),
        _library('rosidl_typesupport_fastrtps_cpp'), _library('fastcdr')])
    described = shared(f'lib{name}__{INTROSPECTION}.so', introspection, [
        message, *_dependency_libraries(INTROSPECTION), _library(INTROSPECTION)])
    # The dispatcher asks the loader for both by name, and the folder they are in is on no search
    # path: it finds them because the extension has them loaded already.
    shared(f'{name}_s__{DISPATCH}.so', dispatch + python, [
        '-Wl,--no-as-needed', over_dds, described, '-Wl,--as-needed', message,
        *_dependency_libraries(PYTHON_GENERATOR), _library(DISPATCH)])


def install(built: Path, destination: Path) -> None:
    """Copy the built Python package into the destination, whole or not at all."""
    target = destination / built.name
    with tempfile.TemporaryDirectory(dir=destination, prefix=f'.{built.name}-') as staging:
        copy = shutil.copytree(built, Path(staging, built.name),
                               ignore=shutil.ignore_patterns('*.c', '*.o'))
        (copy / '__init__.py').touch()
        shutil.rmtree(target, ignore_errors=True)
        copy.rename(target)


def register(name: str, files: Sequence[Path]) -> None:
    """Enter the package into the environment's ament index, for the command line tools of ROS."""
    for path in files:
        target = SHARE / name / _in_package(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)
    index = SHARE / 'ament_index' / 'resource_index'
    names = sorted(f'{_in_package(path)}\n' for path in files)
    for kind, content in (('packages', ''), ('rosidl_interfaces', ''.join(names))):
        (index / kind).mkdir(parents=True, exist_ok=True)
        (index / kind / name).write_text(content)


def build(destination: Path, package: Package = TF2_MSGS) -> Path:
    """
    Generate, compile and install the package.

    :returns: the folder of the package.
    :raises BuildError: where something is missing or fails.
    """
    check_tools()
    os.environ['AMENT_PREFIX_PATH'] = str(PREFIX)  # where the generators look for the others
    destination.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        generators = Generators(package, Path(work))
        folders = generators.run()
        built = folders[-1] / package.name
        link(package.name, compile_sources(package.name, folders), built)
        install(built, destination)
        if destination.resolve() == SITE_PACKAGES.resolve():
            register(package.name, [
                *generators.definition_files.values(), *generators.idl_files.values(),
                *generators.hash_files.values()])
    return destination / package.name


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('package', type=Path, nargs='?', metavar='FOLDER',
                        help='folder named like the package, with .msg and .srv files (default: '
                        'tf2_msgs, without files)')
    parser.add_argument('--into', type=Path, default=SITE_PACKAGES, metavar='FOLDER',
                        help="folder to build the package in (default: this Python's own)")
    arguments = parser.parse_args()
    try:
        package = Package.of_folder(arguments.package) if arguments.package else TF2_MSGS
        print('built', build(arguments.into, package))
    except BuildError as error:
        sys.exit(f'the messages were not built: {error}')


def _in_package(file: Path) -> Path:
    """Return the path of a file below its package: msg/NAME.idl for instance."""
    return Path(file.parent.name, file.name)


def _sources(folder: Path) -> Iterator[Path]:
    """Yield the C files of a folder, and a C++ file that is all of them: headers are read once."""
    yield from folder.rglob('*.c')
    if parts := sorted(folder.rglob('*.cpp')):
        whole = folder / 'whole.cpp'
        whole.write_text(''.join(f'#include "{part}"\n' for part in parts))
        yield whole


def _library(name: str) -> str:
    return str(LIB / f'lib{name}.so')


def _dependency_libraries(kind: str) -> list[str]:
    return [_library(f'{name}__{kind}') for name in DEPENDENCIES]


def _numpy_headers() -> Path:
    import numpy
    return Path(numpy.get_include())


def _call(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise BuildError(f'{" ".join(command[:2])} failed with\n{done.stderr.strip()}')


if __name__ == '__main__':
    main()
