# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
People and things that move between a camera and a rendered room.

    python benchmarks/moving_objects.py [--hand] [--objects NAME...] SEED...

A person walks past 1.6 m away (``cross``) or comes as near as a metre (``near``), two of them pass
each other (``two``), two stacks of cartons turn as they are pushed past (``cartons``), or a poster
is held and moved in front of the camera (``poster``): up to 40 % of the view and more than half of
the keypoints. Or nothing moves (``nothing``). The camera (320x240, 30 Hz, a Kinect's noise) is at
rest, or in a hand with ``--hand``. Printed are the largest error of the pose, that at the end, the
largest one in standard deviations that the odometry reports, and the frames that were lost.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator

import cv2
import numpy as np
from at_rest import CAMERA
from passing import RATE, errors_of, measured, room_of

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.sources.synthetic import furniture, materials, prints
from aick_ros.sources.synthetic.assembly import Assembly
from aick_ros.sources.synthetic.renderer import Picture, Renderer

BEFORE, AFTER = 20, 15  # frames without objects, and after their time
STRIDE = 0.9  # Hz
FORWARD = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""From x to the right, y away and z up to the optical axes of a camera, 4x4."""

Build = Callable[[Assembly], None]
Motion = Callable[[float], np.ndarray]  # time [s] to a pose, 4x4
Part = tuple[Renderer, Motion]


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0, turn: float = 0.0,
       swing: float = 0.0) -> np.ndarray:
    """Return a pose: a place [m], turned about z and then swung about x [rad]."""
    pose = np.eye(4)
    pose[:3, :3] = se3.exp_rotation((0, 0, turn)) @ se3.exp_rotation((swing, 0, 0))
    pose[:3, 3] = x, y, z
    return pose


def still(time: float) -> np.ndarray:
    """Return no motion."""
    return np.eye(4)


def part(rng: np.random.Generator, build: Build, motion: Motion = still) -> Part:
    """Return what is built, and how it moves."""
    assembly = Assembly(rng)
    build(assembly)
    return Renderer(assembly.surfaces, CAMERA), motion


def person(rng: np.random.Generator) -> list[Part]:
    """Return a person who faces -y and walks."""
    cloth = materials.fabric(materials.hue(rng), materials.hue(rng))
    jeans, skin = materials.fabric((60, 70, 100)), materials.glaze((205, 170, 140), (60, 40, 30))

    def body(here: Assembly) -> None:
        here.at(z=0.85).cone(0.17, 0.2, 0.55, cloth)
        here.at(z=1.4).cone(0.2, 0.07, 0.08, cloth)
        here.at(z=1.45).ball(0.11, skin)

    def limb(side: int, place: tuple[float, float], swing: float) -> Motion:
        x, z = place
        return lambda time: at(side * x, 0.0, z, swing=side * swing * np.sin(
            2 * np.pi * STRIDE * time))

    parts = [part(rng, body)]
    for side in (-1, 1):
        parts.append(part(rng, lambda here: here.at(z=-0.85).cone(0.06, 0.09, 0.87, jeans),
                          limb(side, (0.09, 0.87), 0.45)))
        parts.append(part(rng, lambda here: here.at(z=-0.6).cone(0.045, 0.055, 0.6, cloth),
                          limb(side, (0.25, 1.4), -0.4)))
    return parts


def stacks(here: Assembly) -> None:
    """Stack cartons as high as a person."""
    furniture.cartons(here)
    furniture.cartons(here.at(z=0.86))


def poster(here: Assembly) -> None:
    """Add a poster."""
    here.at(z=-0.3).panel(0.6, 0.6, prints.poster)


def held(time: float) -> np.ndarray:
    """Return where a poster is held, before the camera: it comes, is moved about, and goes."""
    x = -1.2 + 1.2 * min(time, 1.0) + 0.6 * max(time - 3.5, 0.0)
    x += 0.3 * np.sin(2 * np.pi * 0.4 * time) * min(time, 1.0)
    return at(x, 0.9 + 0.15 * np.sin(2 * np.pi * 0.3 * time),
              0.1 * np.sin(2 * np.pi * 0.5 * time))


OBJECTS: dict[str, tuple[float, list[Motion]]] = {
    'cross': (4.5, [lambda time: at(-2.5 + 1.2 * time, 1.6, turn=np.pi / 2)]),
    'near': (6.0, [lambda time: at(0.15, max(4.2 - 1.1 * time, 1.0))]),
    'two': (5.0, [lambda time: at(-2.5 + 1.2 * time, 1.7, turn=np.pi / 2),
                  lambda time: at(2.6 - time, 1.3, turn=-np.pi / 2)]),
    'cartons': (4.5, [lambda time: at(-1.9 + 0.85 * time, 1.5, turn=0.5 * time)]),
    'poster': (5.0, [held]),
    'nothing': (3.0, [])}
"""How long they move [s], and how, in axes of the floor below the camera or of the camera."""


class Scene:
    """A room with objects that move in it."""

    def __init__(self, name: str, seed: int, is_held: bool) -> None:
        rng = np.random.default_rng([seed, 77])
        duration, self._motions = OBJECTS[name]
        self.count = BEFORE + round(duration * RATE) + AFTER
        self._room, self._seed = room_of(seed), seed
        self.poses = self._room.poses(self.count, is_held)
        view = self.poses[0]
        x, y, _ = view[:3, 2]
        self._origin = at(view[0, 3], view[1, 3], turn=np.arctan2(y, x) - np.pi / 2)
        if name in ('cartons', 'poster'):
            self._objects = [[part(rng, {'cartons': stacks, 'poster': poster}[name])]]
        else:
            self._objects = [person(rng) for _ in self._motions]
        if name == 'poster':
            self._origin = view @ FORWARD

    def picture(self, index: int) -> Picture:
        """Return what the camera sees."""
        room = self._room.picture(self.poses[index])
        colour, depth = room.colour.copy(), np.nan_to_num(room.depth, nan=np.inf)
        time = (index - BEFORE) / RATE
        for parts, motion in zip(self._objects, self._motions) if time >= 0.0 else ():
            for renderer, own in parts:
                pose = self._origin @ motion(time) @ own(time)
                seen = renderer.render(se3.inverse(pose) @ self.poses[index])
                nearer = np.nan_to_num(seen.depth, nan=np.inf) < depth
                colour[nearer], depth[nearer] = seen.colour[nearer], seen.depth[nearer]
        return Picture(colour, np.where(np.isfinite(depth), depth, np.nan))

    def frames(self) -> Iterator[RgbdFrame]:
        """Return the frames, with the noise of the camera."""
        return measured(map(self.picture, range(self.count)), self._seed)


def main() -> None:
    """Print a row for each kind of objects and each room."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('seeds', type=int, nargs='+')
    parser.add_argument('--hand', action='store_true', help='the camera is in a hand')
    parser.add_argument('--objects', nargs='+', default=list(OBJECTS), choices=list(OBJECTS))
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print('| objects | room | largest [mm] | at the end [mm] | in sigma | lost |')
    print('|' + 6 * '---|')
    for name in options.objects:
        for seed in options.seeds:
            scene = Scene(name, seed, options.hand)
            errors = errors_of(scene.frames(), scene.poses)
            print(f'| {name} | {seed} | {errors.largest:.1f} | {errors.last:.1f} | '
                  f'{errors.ratios.max():.1f} | {errors.lost} |', flush=True)


if __name__ == '__main__':
    main()
