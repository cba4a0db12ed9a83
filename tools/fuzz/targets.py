# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Targets of damaged inputs: by name, a function of the bytes of an input and a folder."""

from __future__ import annotations

import shutil
import struct
import zlib
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from kernel_calls import call_kernel
from worker import Target

from aick_ros.borders import encoded_image
from aick_ros.borders.yaml_text import parse_yaml
from aick_ros.cli.input.settings_file import read_settings_file
from aick_ros.evaluation.benchmark.journal import begin
from aick_ros.features import vocabulary
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import read_trajectory
from aick_ros.messages import compressed_image, png_jpeg, raw_image
from aick_ros.messages.camera_info import to_camera
from aick_ros.messages.rvl import decode_rvl
from aick_ros.settings import Settings
from aick_ros.sources import SourceOptions, open_source
from aick_ros.sources.calibration import read_camera

SEEDS = Path(__file__).parent / 'seeds'
"""A folder for each target, with inputs as they should be, and with those that failed once."""

IMAGE = struct.Struct('<3I2B')
"""Rows, columns, step, byte order and number of the encoding, before the data of an image."""

INFO = struct.Struct('<8I2B21d')
"""Fields of a camera_info: size, binning, roi; model, rectified; k and p. The rest is d."""

COLOUR_ENCODINGS = (*raw_image.COLOUR_ENCODINGS, '16UC1', 'rgb17', '')
DEPTH_ENCODINGS = (*raw_image.DEPTH_ENCODINGS, 'rgb8', '')
FORMATS = ('16UC1; compressedDepth png', '32FC1; compressedDepth png', '16UC1; compressedDepth',
           '16UC1; compressedDepth rvl', '32FC1; compressedDepth rvl',
           'rgb8; jpeg compressed bgr8', '16UC1; png compressed', '')
MODELS = ('', 'plumb_bob', 'rational_polynomial', 'equidistant', 'fisheye62')


def colour_file(data: bytes, _: Path) -> None:
    """Decode PNG or JPEG data."""
    png_jpeg.decode_colour(data)


def png_with_checksums(data: bytes, _: Path) -> None:
    """Decode PNG data whose chunks have right checksums, so that the damage reaches libpng."""
    content, start = bytearray(data), 8
    while start + 12 <= len(content):
        end = start + 8 + int.from_bytes(content[start:start + 4], 'big')
        content[end:end + 4] = zlib.crc32(content[start + 4:end]).to_bytes(4, 'big')
        start = end + 4
    encoded_image.decode(bytes(content))


def compressed_depth(data: bytes, _: Path) -> None:
    """Decode a message whose first byte chooses the format."""
    message = SimpleNamespace(format=FORMATS[data[0] % len(FORMATS)] if data else '',
                              data=data[1:])
    compressed_image.decode_depth(message)


def rvl(data: bytes, _: Path) -> None:
    """Decode RVL data after two bytes of size."""
    width, height = data[:2] if len(data) > 1 else (1, 1)
    decode_rvl(data[2:], width, height)


def raw_colour(data: bytes, _: Path) -> None:
    """Decode the colour image of a message."""
    raw_image.decode_colour(image_message(data, COLOUR_ENCODINGS))


def raw_depth(data: bytes, _: Path) -> None:
    """Decode the depth image of a message."""
    raw_image.decode_depth(image_message(data, DEPTH_ENCODINGS))


def image_message(data: bytes, encodings: tuple[str, ...]) -> SimpleNamespace:
    """Return the message that bytes stand for."""
    head = data[:IMAGE.size].ljust(IMAGE.size, b'\0')
    height, width, step, order, encoding = IMAGE.unpack(head)
    return SimpleNamespace(
        height=height, width=width, step=step, is_bigendian=order,
        encoding=encodings[encoding % len(encodings)], data=data[IMAGE.size:])


def camera_info(data: bytes, _: Path) -> None:
    """Make the camera of a camera_info, and use it on a few pixels."""
    message, rectified = info_message(data)
    camera = to_camera(message, rectified)
    corners = np.array([(0.0, 0.0), (camera.width - 1.0, camera.height - 1.0)])
    camera.project(np.array([(0.1, 0.2, 1.0), (-3.0, 2.0, 0.5)]))
    camera.normalize(corners)


def info_message(data: bytes) -> tuple[SimpleNamespace, bool]:
    """Return the camera_info that bytes stand for, and whether the image is rectified."""
    width, height, column, row, x, y, roi_width, roi_height, model, rectified, *numbers = (
        INFO.unpack(data[:INFO.size].ljust(INFO.size, b'\0')))
    rest = data[INFO.size:]
    return SimpleNamespace(
        width=width, height=height, binning_x=column, binning_y=row,
        roi=SimpleNamespace(x_offset=x, y_offset=y, width=roi_width, height=roi_height),
        distortion_model=MODELS[model % len(MODELS)], k=numbers[:9], p=numbers[9:],
        d=np.frombuffer(rest[:len(rest) // 8 * 8], '<f8').tolist()), bool(rectified % 2)


def calibration(suffix: str, data: bytes, folder: Path) -> None:
    """Read a calibration file."""
    read_camera(_file(folder, f'camera.{suffix}', data))


def yaml(data: bytes, _: Path) -> None:
    """Parse YAML."""
    parse_yaml(data.decode('utf-8', 'replace'))


def settings(data: bytes, folder: Path) -> None:
    """Read a parameter file, and apply it."""
    read_settings_file(_file(folder, 'settings.yaml', data)).applied_to(Settings())


def trajectory(data: bytes, folder: Path) -> None:
    """Read a trajectory, and interpolate it."""
    poses = read_trajectory(_file(folder, 'groundtruth.txt', data))
    poses.at(int(poses.stamps[0]) // 2 + int(poses.stamps[-1]) // 2)


def tum_list(data: bytes, folder: Path) -> None:
    """Read a folder of the TUM benchmark, whose list is the input, to its end."""
    _file(folder, 'rgb.txt', data)
    _file(folder, 'depth.txt', (SEEDS / 'tum_list' / 'rgb.txt').read_bytes())
    _read(folder, SourceOptions(camera=SEEDS / 'calibration_json' / 'camera.json'))


def numbered_images(data: bytes, folder: Path) -> None:
    """Read a folder of numbered images, whose pose file and intrinsics are the input."""
    matrices = data.partition(b'\n\n')
    _file(folder, 'camera-intrinsics.txt', matrices[0])
    _file(folder, 'frame-000001.pose.txt', matrices[2])
    for kind in ('color', 'depth'):
        shutil.copy(SEEDS / 'png' / f'{kind}.png', folder / f'frame-000001.{kind}.png')
    _read(folder)


def bag(suffix: str, data: bytes, folder: Path) -> None:
    """Read a bag of one file to its end."""
    _read(_file(folder, f'bag.{suffix}', data))


def bag_metadata(data: bytes, folder: Path) -> None:
    """Read a bag whose metadata is the input."""
    shutil.copy(SEEDS / 'mcap' / 'small.mcap', folder / 'small.mcap')
    _file(folder, 'metadata.yaml', data)
    _read(folder)


def words(data: bytes, folder: Path) -> None:
    """Load a vocabulary, and find the words of a few descriptors."""
    loaded = vocabulary.load(_file(folder, 'words.npz', data))
    loaded.words_of(np.zeros_like(loaded.words[:2]), 10.0)


def journal(data: bytes, folder: Path) -> None:
    """Resume a benchmark from its journal, the first line of which is right."""
    path = folder / 'results.json.partial'
    begin(path, [])
    path.write_bytes(path.read_bytes() + data)
    begin(path, [])


def _read(path: Path, options: SourceOptions = SourceOptions()) -> None:
    """Read a recording to its end, each damaged image reported."""
    source = open_source(path, options)
    found: list[RgbdFrame] = []
    for frame in source.frames(lambda error: None):
        found[:] = [frame]
    len(source), source.name, source.ground_truth


def _file(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


TARGETS: dict[str, Target] = {
    'png': colour_file, 'png_with_checksums': png_with_checksums, 'jpeg': colour_file,
    'compressed_depth': compressed_depth, 'rvl': rvl, 'raw_colour': raw_colour,
    'raw_depth': raw_depth, 'camera_info': camera_info,
    'calibration_json': partial(calibration, 'json'),
    'calibration_yaml': partial(calibration, 'yaml'), 'yaml': yaml, 'settings': settings,
    'trajectory': trajectory, 'tum_list': tum_list, 'numbered_images': numbered_images,
    'mcap': partial(bag, 'mcap'), 'sqlite3': partial(bag, 'db3'), 'ros1': partial(bag, 'bag'),
    'bag_metadata': bag_metadata, 'vocabulary': words, 'journal': journal,
    'kernels': call_kernel}
"""Name -> target. The node's callbacks are added where ROS is installed."""

DECODERS = ('png', 'png_with_checksums', 'jpeg', 'compressed_depth')
"""Targets that use the codecs of OpenCV."""
