# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rendered rooms by cameras with flaws that neither calibration nor stamps report."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import cv2
import numpy as np
from other_views import holes
from weights import SENSORS, with_time_of_flight_noise

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.messages.depth_to_colour import DepthToColour
from aick_ros.sources.synthetic import ColourSensor, DepthSensor, SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.motion_blur import optical_flow
from aick_ros.sources.synthetic.path import HandheldPath
from aick_ros.sources.synthetic.room import furnished_room
from aick_ros.sources.synthetic.scene import Scene

_STREAM = 77  # of the random numbers of a camera; a rendered source has its own


@dataclass(frozen=True)
class Flaws:
    """
    Flaws of a camera; zeros are none.

    :param readout: time from the first to the last row of a colour image [s].
    :param delay: time from the colour to the depth image, which have one stamp [s].
    :param offset: of depth to colour, a twist [m, rad].
    :param distortion: first radial coefficient of the colour camera's lens.
    :param scale: relative error of the depth.
    :param jitter: standard deviation of the stamps [s].
    :param latency: time from an image to its stamp [s].
    :param repeats: share of the images that are the ones before once more.
    :param drops: share of the images that are missing.
    :param holes: share of the depth image that is missing, in blots.
    :param max_depth: largest depth [m].
    :param depth_readout: time from the first to the last row of a depth image [s].
    """

    readout: float = 0.0
    delay: float = 0.0
    offset: tuple[float, ...] = 6 * (0.0,)
    distortion: float = 0.0
    scale: float = 0.0
    jitter: float = 0.0
    latency: float = 0.0
    repeats: float = 0.0
    drops: float = 0.0
    holes: float = 0.0
    max_depth: float = np.inf
    depth_readout: float = 0.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, rate: float) -> Flaws:
        """
        Return some flaws of a camera with a rate [Hz].

        Stamps that are given on arrival have both jitter and latency, other stamps neither.
        """
        def some(probability: float, low: float, high: float) -> float:
            value, has_it = rng.uniform(low, high), rng.random() < probability
            return float(value) if has_it else 0.0

        on_arrival = float(rng.random() < 0.5)
        return cls(
            readout=min(some(0.5, 0.005, 0.03), 0.9 / rate), delay=some(0.4, -0.02, 0.02),
            offset=tuple(some(0.4, 0.0, 1.0) * rng.normal(0.0, 6 * [0.01])),
            distortion=some(0.4, -0.04, 0.04), scale=some(0.3, -0.02, 0.02),
            jitter=min(some(on_arrival, 0.0005, 0.004), 0.15 / rate),
            latency=some(on_arrival, 0.005, 0.035),
            repeats=some(0.3, 0.02, 0.1), drops=some(0.4, 0.05, 0.2), holes=some(0.3, 0.2, 0.6),
            max_depth=some(0.4, 1.5, 4.0) or np.inf,
            depth_readout=min(some(0.3, 0.005, 0.03), 0.9 / rate))

    def __str__(self) -> str:
        """Return those that a camera has."""
        turn = float(np.degrees(np.linalg.norm(self.offset[3:])))
        named = {
            'readout {:.0f} ms': 1e3 * self.readout, 'depth {:+.0f} ms': 1e3 * self.delay,
            'offset {:.0f} mm': 1e3 * float(np.linalg.norm(self.offset[:3])),
            'turned {:.1f} deg': turn, 'lens {:+.3f}': self.distortion,
            'scale {:+.1f} %': 100 * self.scale, 'jitter {:.1f} ms': 1e3 * self.jitter,
            'latency {:.0f} ms': 1e3 * self.latency, 'repeats {:.0f} %': 100 * self.repeats,
            'drops {:.0f} %': 100 * self.drops, 'holes {:.0f} %': 100 * self.holes}
        texts = [text.format(value) for text, value in named.items() if value]
        if np.isfinite(self.max_depth):
            texts.append(f'up to {self.max_depth:.1f} m')
        if self.depth_readout:
            texts.append(f'readout of depth {1e3 * self.depth_readout:.0f} ms')
        return ', '.join(texts) or 'none'


@dataclass(frozen=True)
class _Faster:
    """A path that is followed faster, by a factor."""

    path: HandheldPath
    factor: float

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` at a time [s]."""
        return self.path.pose(self.factor * time)


@functools.lru_cache(maxsize=1)
def room_of(seed: int) -> Scene:
    """Return the furnished room of a seed."""
    return furnished_room(seed)


class FlawedCamera:
    """
    A rendered room by a camera with flaws.

    :param seed: selects the room, the path and the noise.
    :param camera: as the calibration has it.
    :param rate: of the images [Hz].
    :param kind: of the depth's noise, a name of ``weights.SENSORS``.
    :param speed: of the camera, by that of a careful hand.
    """

    def __init__(self, seed: int, frames: int, camera: Camera, rate: float, kind: str,
                 speed: float, flaws: Flaws) -> None:
        scene, rng = room_of(seed), np.random.default_rng([seed, _STREAM])
        self._seen = SyntheticSource(
            SyntheticOptions(seed=seed, frames=frames, rate=rate, camera=camera,
                             depth_delay=flaws.delay, depth=DepthSensor.perfect(),
                             colour=ColourSensor(sigma=0.0)),
            scene, _Faster(HandheldPath(rng, scene.free), speed))
        self._camera, self._flaws, self._kind, self._seed = camera, flaws, kind, seed
        sensor = SENSORS[kind]
        self._depth = dataclasses.replace(
            sensor, max_depth=min(sensor.max_depth, flaws.max_depth))
        self._registered = DepthToColour(camera, camera, se3.exp(np.array(flaws.offset)))

    def recording(self) -> tuple[list[RgbdFrame], Trajectory]:
        """Return the frames and the true poses at their stamps."""
        frames: list[RgbdFrame] = []
        self._rng = np.random.default_rng([self._seed, _STREAM, 1])
        for index in np.flatnonzero(self._rng.random(len(self._seen)) >= self._flaws.drops):
            frame = self._frame(int(index))
            if frames and self._rng.random() < self._flaws.repeats:
                frame = dataclasses.replace(frames[-1], stamp=frame.stamp)
            if not frames or frame.stamp > frames[-1].stamp:
                frames.append(frame)
        stamps = [frame.stamp for frame in frames]
        return frames, Trajectory(np.array(stamps, np.int64),
                                  np.array([self._seen.pose(stamp) for stamp in stamps]))

    def _frame(self, index: int) -> RgbdFrame:
        seen, flaws, rng = self._seen.frame(index), self._flaws, self._rng
        late = flaws.latency + rng.normal(0.0, flaws.jitter)
        colour = ColourSensor(exposure_swing=0.0).measure(self._warped(seen), 1.0, rng)
        return RgbdFrame(seen.stamp + round(NANOSECONDS * late), colour,
                         self._measured(self._rolled(seen)), self._camera)

    def _warped(self, seen: RgbdFrame) -> np.ndarray:
        """Return the colour image as a rolling shutter takes it through the lens, HxWx3 uint8."""
        camera, flaws = self._camera, self._flaws
        v, u = np.indices(seen.depth.shape, np.float32)
        x, y = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
        bent = 1 - flaws.distortion * (x * x + y * y)  # inverse of the lens, to first order
        flow = optical_flow(seen.depth, camera, self._motion(seen.stamp, flaws.readout))
        share = (v + 0.5) / camera.height - 0.5
        columns = camera.cx + camera.fx * x * bent - share * flow[0]
        rows = camera.cy + camera.fy * y * bent - share * flow[1]
        return cv2.remap(seen.colour, columns.astype(np.float32), rows.astype(np.float32),
                         cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    def _rolled(self, seen: RgbdFrame) -> np.ndarray:
        """Return the depth image as a rolling shutter takes it, HxW float32 [m]."""
        camera, flaws, depth = self._camera, self._flaws, seen.depth
        if not flaws.depth_readout:
            return depth
        twist = self._motion(seen.stamp + round(flaws.delay * NANOSECONDS), flaws.depth_readout)
        flow = optical_flow(depth, camera, twist)
        v, u = np.indices(depth.shape, np.float32)
        share = (v + 0.5) / camera.height - 0.5
        there: np.ndarray = cv2.remap(depth, u - share * flow[0], v - share * flow[1],
                                      cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
        x, y = there * (u - camera.cx) / camera.fx, there * (v - camera.cy) / camera.fy
        return there - share * (twist[2] + twist[3] * y - twist[4] * x)

    def _motion(self, stamp: int, readout: float) -> np.ndarray:
        """Return the motion of the camera during a readout about a stamp, a twist, 6 float32."""
        half = round(readout / 2 * NANOSECONDS)
        twist: np.ndarray = se3.log(
            se3.inverse(self._seen.pose(stamp - half)) @ self._seen.pose(stamp + half))
        return twist.astype(np.float32)

    def _measured(self, depth: np.ndarray) -> np.ndarray:
        """Return a depth image as the camera gives it, HxW float32 [m]."""
        flaws, rng = self._flaws, self._rng
        depth = self._depth.measure(depth, self._camera, rng)
        if self._kind == 'time-of-flight':
            depth = with_time_of_flight_noise(depth, rng)
        if flaws.holes:
            depth = holes(depth, rng, flaws.holes)
        depth = ((1 + flaws.scale) * depth).astype(np.float32)
        return self._registered.reproject(depth) if any(flaws.offset) else depth
