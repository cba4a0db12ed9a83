# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A rendered RGB-D recording with exact ground truth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.sources import OnDamaged, raise_damage
from aick_ros.sources.synthetic.imu import ImuModel, imu_samples
from aick_ros.sources.synthetic.motion_blur import motion_blur
from aick_ros.sources.synthetic.path import HandheldPath
from aick_ros.sources.synthetic.renderer import Renderer
from aick_ros.sources.synthetic.room import furnished_room
from aick_ros.sources.synthetic.scene import Scene
from aick_ros.sources.synthetic.sensor import ColourSensor, DepthSensor
from aick_ros.sources.synthetic.wander import Wander

_EXPOSURE = ((0.6, 0.05, 0.15), (0.4, 0.2, 0.4))  # shares and frequencies [Hz]
# what the random numbers are for; the scene takes 0
_PATH_STREAM, _EXPOSURE_STREAM, _NOISE_STREAM, _IMU_STREAM = 1, 2, 3, 4
_IMU_BEFORE = NANOSECONDS // 2  # chosen: how long an IMU measures before the first frame
_IMU_AHEAD = NANOSECONDS // 50  # chosen: how much longer an image takes to arrive than a sample
_SLOWEST, _FASTEST = 0.01, 1000.0  # Hz
_MOST_FRAMES = 100_000  # chosen: an hour at 30 Hz; their poses are computed before the first


@dataclass(frozen=True)
class SyntheticOptions:
    """
    Options of a rendered recording.

    :param seed: selects the room and the path.
    :param frames: number of frames.
    :param rate: of the frames [Hz].
    :param camera: a camera without distortion.
    :param start: stamp of the first frame [ns].
    :param depth_delay: time from a colour image to its depth image [s].
    :param colour: imperfections of the colour images.
    :param depth: imperfections of the depth images.
    :param imu: at the place of the colour camera; None: there is none.
    :raises InputError: where an option is out of range.
    """

    seed: int = 0
    frames: int = 150
    rate: float = 30.0
    camera: Camera = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
    start: int = 1000 * NANOSECONDS
    depth_delay: float = 0.0
    colour: ColourSensor = ColourSensor()
    depth: DepthSensor = DepthSensor()
    imu: ImuModel | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be rendered."""
        if not 0 <= self.seed < 2 ** 63 or not 1 <= self.frames <= _MOST_FRAMES:
            raise InputError(f'seed {self.seed} and {self.frames} frames: the seed must be 0 to '
                             f'2^63 - 1, the frames 1 to {_MOST_FRAMES}')
        if not _SLOWEST <= self.rate <= _FASTEST:
            raise InputError(f'the rate is {self.rate:g} Hz: it must be {_SLOWEST:g} to '
                             f'{_FASTEST:g}')
        if self.camera.distortion:
            raise InputError('the camera has distortion: synthetic sequences are rendered '
                             'without; leave the coefficients out')
        if not np.isfinite(self.depth_delay):
            raise InputError(f'the depth delay is {self.depth_delay:g} s: it must be finite')

    @classmethod
    def perfect(cls, **options: Any) -> SyntheticOptions:
        """Return options with all imperfections switched off; the keywords are the others."""
        return cls(**{'colour': ColourSensor.perfect(), 'depth': DepthSensor.perfect(),
                      **options})


class CameraPath(Protocol):
    """Pose of the camera at any time."""

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` of the optical frame at a time [s]."""


class SyntheticSource:
    """
    A sequence rendered as it is read.

    Each frame is rendered for itself, so they can be taken in any order and are always the same.

    :param options: what to render.
    :param scene: what to see; None: the furnished room of the seed.
    :param path: of the camera; None: handheld, through the scene's free zone.
    """

    def __init__(self, options: SyntheticOptions = SyntheticOptions(),
                 scene: Scene | None = None, path: CameraPath | None = None) -> None:
        self.name = f'synthetic room, seed {options.seed}'
        self.scene = furnished_room(options.seed) if scene is None else scene
        self._options = options
        self._renderer = Renderer(self.scene.surfaces, options.camera)
        self._path = path or HandheldPath(self._rng(_PATH_STREAM), self.scene.free)
        self._exposure = Wander(self._rng(_EXPOSURE_STREAM), options.colour.exposure_swing,
                                _EXPOSURE)
        stamps = [self._stamp(i) for i in range(options.frames)]
        self.ground_truth = Trajectory(np.array(stamps, np.int64),
                                       np.array([self.pose(stamp) for stamp in stamps]))

    def __len__(self) -> int:
        """Return the number of frames."""
        return self._options.frames

    @property
    def remarks(self) -> Sequence[str]:
        """Sentences on what of it was not used: none."""
        return ()

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """
        Yield the frames.

        :param on_damaged: never called, no frame is damaged.
        """
        for index in range(len(self)):
            yield self.frame(index)

    def frame(self, index: int) -> RgbdFrame:
        """
        Return one frame.

        :raises IndexError: where there is none.
        """
        if not 0 <= index < len(self):
            raise IndexError(f'frame {index} of {len(self)}')
        options, rng = self._options, self._rng(_NOISE_STREAM, index)
        stamp = self._stamp(index)
        depth_stamp = stamp + round(options.depth_delay * NANOSECONDS)
        picture = self._renderer.render(self.pose(stamp))
        depth = picture.depth
        if depth_stamp != stamp:
            depth = self._renderer.render_depth(self.pose(depth_stamp))
        colour = picture.colour
        if options.colour.shutter > 0:
            colour = motion_blur(colour, picture.depth, options.camera, self._exposed(stamp))
        gain = 1.0 + self._exposure.at(self._time(stamp))
        return RgbdFrame(stamp, options.colour.measure(colour, gain, rng),
                         options.depth.measure(depth, options.camera, rng), options.camera,
                         depth_stamp, self._imu(index))

    def pose(self, stamp: int) -> np.ndarray:
        """Return the true ``T_world_camera`` at any stamp [ns]."""
        return self._path.pose(self._time(stamp))

    @cached_property
    def imu(self) -> ImuSamples | None:
        """All samples of the IMU; None where there is none."""
        options = self._options
        if options.imu is None:
            return None
        end = self._stamp(len(self) - 1) + _IMU_AHEAD
        return imu_samples(self.pose, options.start - _IMU_BEFORE, end, options.imu,
                           self._rng(_IMU_STREAM))

    def _imu(self, index: int) -> ImuSamples | None:
        """Return the samples that arrive between the frame before and one."""
        end = self._stamp(index) + _IMU_AHEAD
        if self.imu is None:
            return None
        return self.imu.until(end, self._stamp(index - 1) + _IMU_AHEAD if index else None)

    def _exposed(self, stamp: int) -> np.ndarray:
        """Return the motion of the camera during the exposure, 4x4."""
        half = round(self._options.colour.shutter / 2 * NANOSECONDS)
        T_start_end: np.ndarray = se3.inverse(self.pose(stamp - half)) @ self.pose(stamp + half)
        return T_start_end

    def _stamp(self, index: int) -> int:
        return self._options.start + round(index * NANOSECONDS / self._options.rate)

    def _time(self, stamp: int) -> float:
        return (stamp - self._options.start) / NANOSECONDS

    def _rng(self, *stream: int) -> np.random.Generator:
        return np.random.default_rng([self._options.seed, *stream])
