# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Write the inputs that are damaged: small ones of each kind, made by this package."""

from __future__ import annotations

import json
import shutil
import struct
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from kernel_calls import CALLS
from node_events import COLOUR, DEPTH, DEPTH_INFO, EVENT
from node_events import INFO as NODE_INFO
from node_events import LINK, MOVING, STATIC
from rosbags.convert import convert
from rosbags.typesys import Stores, get_typestore
from targets import COLOUR_ENCODINGS, DEPTH_ENCODINGS, FORMATS, IMAGE, INFO, MODELS, SEEDS

from aick_ros.features.vocabulary import Vocabulary
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory, write_trajectory
from aick_ros.messages.raw_image import encode_depth
from aick_ros.settings import Settings
from aick_ros.settings.text import config_text
from aick_ros.sources.calibration import write_camera
from aick_ros.sources.writers.bag_writer import write_bag

ROWS, COLUMNS = 6, 8
START, PERIOD = 10 ** 18, 33_333_333
CAMERA = Camera(COLUMNS, ROWS, 7.0, 7.5, 3.5, 2.5, 'plumb_bob', (0.1, -0.2, 1e-3, -2e-3, 0.05))


@dataclass
class Recording:
    """Two small frames, and three poses."""

    name: str = 'small'

    def __len__(self) -> int:
        """Return the number of frames."""
        return 2

    @property
    def ground_truth(self) -> Trajectory:
        """Three poses."""
        return Trajectory(START + PERIOD * np.arange(3), np.array(
            [se3.exp((0.1 * i, 0.0, 0.0, 0.0, 0.2 * i, 0.0)) for i in range(3)]))

    def frames(self, _: object = None) -> Iterator[RgbdFrame]:
        """Yield the frames."""
        for i in range(2):
            yield RgbdFrame(START + i * PERIOD, colour(), depth(), CAMERA)


def colour() -> np.ndarray:
    """Return a gradient, HxWx3 uint8."""
    return (np.indices((ROWS, COLUMNS)).sum(0)[..., None] * (9, 7, 5)).astype(np.uint8)


def depth() -> np.ndarray:
    """Return a slanted plane with a hole, HxW float32 [m]."""
    plane = (1.0 + 0.125 * np.indices((ROWS, COLUMNS))[1]).astype(np.float32)
    plane[2, 3] = np.nan
    return plane


def units() -> np.ndarray:
    """Return the depth in millimetres, HxW uint16."""
    return np.nan_to_num(1000 * depth()).astype(np.uint16)


def rvl(image: np.ndarray) -> bytes:
    """Return an image without zeros as RVL data."""
    differences = np.diff(image.ravel().astype(int), prepend=0)
    digits: list[int] = []
    for number in (0, image.size, *((differences << 1) ^ (differences >> 31)).tolist()):
        while number > 7:
            digits.append(number & 7 | 8)
            number >>= 3
        digits.append(number)
    digits += [0] * (-len(digits) % 8)
    text = ''.join(f'{digit:x}' for digit in digits)
    return b''.join(struct.pack('<I', int(text[i:i + 8], 16)) for i in range(0, len(text), 8))


def decoders() -> dict[str, bytes]:
    """Return path -> content for the images."""
    bgr, millimetres = colour()[..., ::-1].copy(), units()
    png, depth_png = (cv2.imencode('.png', image)[1].tobytes() for image in (bgr, millimetres))
    header = struct.pack('<i2f', 0, 100.0, 0.5)
    packed = rvl(np.maximum(millimetres, 1))
    size = struct.pack('<2i', COLUMNS, ROWS)
    seeds = {'png/color.png': png, 'png/depth.png': depth_png,
             'png_with_checksums/color.png': png, 'png_with_checksums/depth.png': depth_png,
             'jpeg/color.jpg': cv2.imencode('.jpg', bgr)[1].tobytes(),
             'jpeg/grey.jpg': cv2.imencode('.jpg', bgr[..., 0], (cv2.IMWRITE_JPEG_PROGRESSIVE, 1)
                                           )[1].tobytes(),
             'rvl/plane': bytes((COLUMNS, ROWS)) + packed}
    for number, kind in enumerate(FORMATS):
        data = header + size + packed if 'rvl' in kind else header + depth_png
        seeds[f'compressed_depth/{number}'] = bytes([number]) + data
    return seeds


def messages() -> dict[str, bytes]:
    """Return path -> content for raw images and camera_info."""
    seeds = {}
    for target, encodings in (('raw_colour', COLOUR_ENCODINGS), ('raw_depth', DEPTH_ENCODINGS)):
        for number in range(len(encodings)):
            seeds[f'{target}/{number}'] = IMAGE.pack(
                ROWS, COLUMNS, 8 * COLUMNS, 0, number) + bytes(range(64)) * ROWS
    as_sent = encode_depth(depth())
    seeds['raw_depth/plane'] = IMAGE.pack(
        ROWS, COLUMNS, as_sent.step, 0, DEPTH_ENCODINGS.index('32FC1')) + as_sent.data.tobytes()
    k, p = CAMERA.matrix, np.hstack([CAMERA.matrix, np.zeros((3, 1))])
    for model, count in (('plumb_bob', 5), ('rational_polynomial', 8), ('equidistant', 4)):
        seeds[f'camera_info/{model}'] = INFO.pack(
            COLUMNS, ROWS, 0, 0, 0, 0, 0, 0, MODELS.index(model), 0, *k.flat, *p.flat
        ) + struct.pack(f'<{count}d', *np.linspace(0.1, -0.01, count))
    seeds['camera_info/rectified'] = INFO.pack(
        COLUMNS, ROWS, 2, 2, 1, 1, 4, 4, 0, 1, *k.flat, *p.flat)
    return seeds


def texts() -> dict[str, bytes]:
    """Return path -> content for lists, parameters and journals."""
    names = [f'{START // 10 ** 9}.{i:02d} {SEEDS.name}/none-{i}.png' for i in range(3)]
    rows = '\n'.join(' '.join(map(str, row)) for row in np.eye(4).tolist())
    k = '\n'.join(' '.join(map(str, row)) for row in CAMERA.matrix.tolist())
    pair = {'method': 'aick', 'recording': 'r', 'pair': [0, 1], 'translation': 0.01,
            'rotation': 0.02, 'milliseconds': 3.0, 'failure': ''}
    frame = {'method': 'aick', 'recording': 'r', 'frame': 0, 'milliseconds': 2.5}
    nested = 'a: &a [1, 2.5, yes, null]\nb: {c: *a, d: !!str 7}\ne: |\n  text\nf: 2001-01-01\n'
    camera = ('image_width: 8\nimage_height: 6\ncamera_matrix: {data: [7, 0, 3, 0, 7, 2, 0, 0, 1]}'
              '\ndistortion_model: plumb_bob\ndistortion_coefficients: {data: [0, 0, 0, 0, 0]}\n')
    seeds = {'tum_list/rgb.txt': '# colour\n' + '\n'.join(names) + '\n',
             'numbered_images/matrices.txt': f'{k}\n\n{rows}\n',
             'journal/lines': json.dumps(frame) + '\n' + json.dumps(pair) + '\n',
             'yaml/nested.yaml': nested, 'yaml/camera.yaml': camera,
             'calibration_yaml/camera.yaml': camera,
             'settings/short.yaml': '/**:\n  ros__parameters:\n    aick: {alpha: 0.5}\n'
                                    '    features.detector: orb\n    preset: default\n',
             'settings/all.yaml': config_text(Settings())}
    return {path: text.encode() for path, text in seeds.items()}


def files(folder: Path) -> dict[str, bytes]:
    """Return path -> content of what is written by writers of files, into a folder."""
    write_trajectory(folder / 'trajectory', Recording().ground_truth)
    write_camera(folder / 'camera.json', CAMERA)
    rng = np.random.default_rng(0)
    words = Vocabulary('orb', rng.integers(0, 256, (4, 32), np.uint8), 'nothing')
    seeds = {'trajectory/short.txt': (folder / 'trajectory').read_bytes(),
             'calibration_json/camera.json': (folder / 'camera.json').read_bytes(),
             'vocabulary/orb.npz': words.to_bytes()}
    for storage, suffix in (('mcap', 'mcap'), ('sqlite3', 'db3')):
        bag = folder / storage / 'small'
        bag.parent.mkdir()
        write_bag(bag, Recording(), storage)
        seeds[f'{storage}/small.{suffix}'] = (bag / f'small.{suffix}').read_bytes()
    seeds['bag_metadata/metadata.yaml'] = (folder / 'mcap/small/metadata.yaml').read_bytes()
    convert([folder / 'mcap' / 'small'], folder / 'ros1.bag', 'sqlite3', 8, None, '',
            get_typestore(Stores.ROS2_JAZZY), get_typestore(Stores.ROS1_NOETIC), (), (), (), ())
    seeds['ros1/small.bag'] = (folder / 'ros1.bag').read_bytes()
    return seeds


def node_scripts() -> dict[str, bytes]:
    """Return path -> content for what a node receives: calibration, transform, three pairs."""
    rows, columns = 48, 64
    camera = Camera(columns, rows, 60.0, 60.0, 31.5, 23.5)
    info = INFO.pack(columns, rows, *(0,) * 8, *camera.matrix.flat, *(0.0,) * 12)
    link = LINK.pack(1, 2, 0.1, 0.0, 0.2, 0.5, -0.5, 0.5, -0.5)
    rng = np.random.default_rng(0)
    wall = cv2.resize(rng.integers(0, 256, (12, 20), np.uint8), (96, rows),
                      interpolation=cv2.INTER_NEAREST)
    metres = np.full((rows, columns), 1500, '<u2').tobytes()
    script = event(NODE_INFO, 0, info) + event(STATIC, 0, link) + event(MOVING, 0, link)
    for number in range(3):
        image = wall[:, 2 * number:][:, :columns].tobytes()
        script += event(COLOUR, number, IMAGE.pack(
            rows, columns, columns, 0, COLOUR_ENCODINGS.index('mono8')) + image)
        script += event(DEPTH, number, IMAGE.pack(
            rows, columns, 2 * columns, 0, DEPTH_ENCODINGS.index('16UC1')) + metres)
    own_camera = event(DEPTH_INFO, 0, info) + event(STATIC, 0, link + LINK.pack(
        2, 3, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    return {'node/registered': b'\0' + script, 'node/own_camera': b'\1' + own_camera + script}


def kernel_calls() -> dict[str, bytes]:
    """Return path -> content for a call of each kernel, with arguments that fit."""
    return {f'kernels/{name}': bytes([number]) for number, name in enumerate(CALLS)}


def event(kind: int, number: int, payload: bytes) -> bytes:
    """Return an event at the stamp of a frame."""
    return EVENT.pack(kind, START // 10 ** 9, number * PERIOD, len(payload)) + payload


def main() -> None:
    """Write the seeds; files that are there already and are not made here stay."""
    with tempfile.TemporaryDirectory() as folder:
        seeds = {**decoders(), **messages(), **texts(), **files(Path(folder)),
                 **node_scripts(), **kernel_calls()}
    for path, content in seeds.items():
        (SEEDS / path).parent.mkdir(parents=True, exist_ok=True)
        (SEEDS / path).write_bytes(content)
    shutil.rmtree(SEEDS / '__pycache__', ignore_errors=True)


if __name__ == '__main__':
    main()
