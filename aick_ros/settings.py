# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Every parameter once: name, default, range, unit and one sentence.

ROS parameters, ``--set``, the YAML file and the README's table are all made from the dataclasses
below. A group is a frozen dataclass, a nested group adds its name and a dot.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from aick_ros.errors import InputError


@dataclass(frozen=True)
class Parameter:
    """
    Description of one parameter.

    :param name: dotted name, for example ``aick.alpha``.
    :param type: bool, int, float, str or tuple (of floats).
    :param choices: the values a string parameter may take; empty: any.
    """

    name: str
    type: type
    default: Any
    description: str
    unit: str = ''
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def range_text(self) -> str:
        """The range as a person reads it, '' where there is none."""
        if self.choices:
            return ', '.join(repr(choice) for choice in self.choices)
        if self.minimum is None and self.maximum is None:
            return ''
        low = '-inf' if self.minimum is None else f'{self.minimum:g}'
        high = 'inf' if self.maximum is None else f'{self.maximum:g}'
        return f'{low} to {high}' + (f' {self.unit}' if self.unit else '')

    def convert(self, value: Any) -> Any:
        """
        Return ``value`` in this parameter's type.

        :param value: of the right type, or its text.
        :raises InputError: with the range where the value does not fit.
        """
        try:
            converted = _CONVERTERS[self.type](value)
        except (TypeError, ValueError):
            raise self._refuse(value, f'is not {_TYPE_NAMES[self.type]}') from None
        if self.choices and converted not in self.choices:
            raise self._refuse(value, f'is none of {self.range_text}')
        if self.type in (int, float):
            low = -math.inf if self.minimum is None else self.minimum
            high = math.inf if self.maximum is None else self.maximum
            if not (low <= converted <= high and math.isfinite(converted)):
                raise self._refuse(value, f'is outside {self.range_text or "the finite numbers"}')
        return converted

    def _refuse(self, value: Any, reason: str) -> InputError:
        return InputError(f'{self.name} = {value!r} {reason}; it is: {self.description}')


def parameter(default: Any, description: str, **kwargs: Any) -> Any:
    """Declare one parameter of a group; the keywords are those of :class:`Parameter`."""
    return field(default=default, metadata={'description': description, **kwargs})


@dataclass(frozen=True)
class OrbSettings:
    """ORB keypoints; the defaults are the paper's (IV-B)."""

    nfeatures: int = parameter(
        1100, 'Keypoints to look for in an image.', minimum=10, maximum=20000)
    scale_factor: float = parameter(
        1.2, 'Ratio of two neighbouring pyramid levels.', minimum=1.01, maximum=2.0)
    levels: int = parameter(8, 'Pyramid levels.', minimum=1, maximum=16)
    edge_threshold: int = parameter(
        2, 'Border without keypoints.', unit='px', minimum=0, maximum=100)
    patch_size: int = parameter(
        31, 'Side of the patch a descriptor is taken from.', unit='px', minimum=5, maximum=101)
    fast_threshold: int = parameter(
        20, 'Least contrast of a FAST corner.', unit='grey levels', minimum=1, maximum=255)


@dataclass(frozen=True)
class SurfSettings:
    """Upright SURF keypoints; the defaults are the paper's (IV-B)."""

    octaves: int = parameter(
        5, 'How often the filters and the steps between them double.', minimum=1, maximum=8)
    intervals: int = parameter(
        5, 'Filters of an octave; all but the outermost can have a maximum.',
        minimum=3, maximum=8)
    init_sample: int = parameter(
        2, 'Distance of the samples of the first octave.', unit='px', minimum=1, maximum=8)
    threshold: float = parameter(
        0.00001, 'Least determinant of the Hessian, of an image of grey levels 0 to 1.',
        minimum=0.0, maximum=1.0)


@dataclass(frozen=True)
class SiftSettings:
    """SIFT keypoints; the defaults are OpenCV's but for the number."""

    nfeatures: int = parameter(
        1100, 'Keypoints to look for in an image.', minimum=10, maximum=20000)
    octave_layers: int = parameter(
        3, 'Scales of an octave that can have an extremum.', minimum=1, maximum=8)
    contrast_threshold: float = parameter(
        0.04, 'Least contrast of an extremum; more leaves out weak ones.',
        minimum=0.0, maximum=1.0)
    edge_threshold: float = parameter(
        10.0, 'Largest ratio of the two curvatures of an extremum; less leaves out edges.',
        minimum=1.0, maximum=1000.0)
    sigma: float = parameter(
        1.6, 'Standard deviation of the Gaussian at the first scale.',
        unit='px', minimum=0.6, maximum=10.0)


@dataclass(frozen=True)
class FeatureSettings:
    """Keypoints of the colour image."""

    detector: str = parameter(
        'orb', 'Keypoint detector and descriptor.', choices=('orb', 'surf', 'sift'))
    max_keypoints: int = parameter(
        400, 'Keypoints with depth kept; 0 keeps all.', minimum=0, maximum=20000)
    cell_size: float = parameter(
        60.0, 'Side of the cells from which keypoints are taken evenly, the strongest of each '
        'first; 0 takes the strongest of the image.', unit='px', minimum=0.0, maximum=10000.0)
    pixel_sigma: float = parameter(
        0.8, 'Standard deviation of a keypoint at the finest pyramid level.',
        unit='px', minimum=0.01, maximum=10.0)
    orb: OrbSettings = OrbSettings()
    surf: SurfSettings = SurfSettings()
    sift: SiftSettings = SiftSettings()


@dataclass(frozen=True)
class SensorSettings:
    """What the depth camera measures, and how well."""

    min_depth: float = parameter(
        0.1, 'Nearer depths are not used.', unit='m', minimum=0.0, maximum=100.0)
    max_depth: float = parameter(
        10.0, 'Farther depths are not used.', unit='m', minimum=0.1, maximum=1000.0)
    depth_sigma: float = parameter(
        0.0015, 'Standard deviation of the depth at one metre.',
        unit='m', minimum=1e-6, maximum=1.0)
    depth_exponent: float = parameter(
        2.0, 'Power of the depth that its standard deviation grows with: 2 for structured light '
        'and stereo, 0 to 1 for time of flight.', minimum=0.0, maximum=4.0)
    depth_jump: float = parameter(
        0.02, 'Relative depth difference between neighbouring pixels that counts as an edge.',
        minimum=0.001, maximum=1.0)

    def __post_init__(self) -> None:
        """Refuse a range without depths."""
        if self.min_depth >= self.max_depth:
            raise InputError(f'sensor.min_depth = {self.min_depth:g} m and sensor.max_depth = '
                             f'{self.max_depth:g} m: the first must be less than the second')


@dataclass(frozen=True)
class AickSettings:
    """Adaptive Iterative Closest Keypoint (III-A)."""

    alpha: float = parameter(
        0.6, 'Shrinking factor of the descriptor weight, w = alpha^i.', minimum=0.0, maximum=1.0)
    iterations: int = parameter(10, 'Iterations.', minimum=1, maximum=100)
    lambda_e: float = parameter(
        0.01, 'Threshold on the Euclidean distance of a match (Eq. 2).',
        unit='m', minimum=1e-4, maximum=10.0)
    lambda_f: float = parameter(
        0.2, 'Threshold on the descriptor distance of a match (Eq. 2).',
        minimum=1e-3, maximum=10.0)
    vocabulary: str = parameter(
        '', 'Vocabulary for the fast search, a file or the name of one that comes with the '
        'package; without one all keypoints are compared with all.')
    word_radius: float = parameter(
        0.26, 'R_w: words nearer than this are those of a keypoint, in the unit of lambda_f; '
        'from 4 on all words are.', minimum=0.0, maximum=10.0)


@dataclass(frozen=True)
class RefinementSettings:
    """The least-squares problem that ends a registration."""

    mode: str = parameter(
        'joint', 'none: the pose as AICK found it (the paper); keypoints: keypoints tracked to a '
        'fraction of a pixel; joint: these and the depth image.',
        choices=('none', 'keypoints', 'joint'))
    iterations: int = parameter(4, 'Most iterations.', minimum=1, maximum=100)
    max_tracks: int = parameter(
        400, 'Keypoints that are tracked, the strongest.', minimum=3, maximum=20000)
    track_window: int = parameter(
        11, 'Side of the window that is tracked.', unit='px', minimum=5, maximum=51)
    track_sigma: float = parameter(
        0.6, 'Standard deviation of a tracked keypoint.', unit='px', minimum=0.01, maximum=10.0)
    surface_points: int = parameter(
        2000, 'Points of the depth image that are used.', minimum=10, maximum=100000)
    reach: float = parameter(
        0.1, 'Farthest distance of a point from its plane.', unit='m', minimum=0.001,
        maximum=10.0)
    robust_width: float = parameter(
        1.7, 'Residual whose weight is a quarter, in standard deviations.', minimum=0.5,
        maximum=100.0)


@dataclass(frozen=True)
class OdometrySettings:
    """Which registrations the odometry believes, and what it does without one."""

    reference: str = parameter(
        'keyframe', 'What a frame is registered to: the previous frame, or one that is kept '
        'while it serves.', choices=('previous', 'keyframe'))
    min_overlap: float = parameter(
        0.7, 'Share of the keypoints that must be found in the keyframe for it to be kept.',
        minimum=0.0, maximum=1.0)
    min_matches: int = parameter(
        12, 'Fewer matches are not believed.', minimum=3, maximum=10000)
    max_speed: float = parameter(
        3.0, 'Faster translations are not believed.', unit='m/s', minimum=0.01, maximum=1000.0)
    max_turn_rate: float = parameter(
        6.0, 'Faster rotations are not believed.', unit='rad/s', minimum=0.01, maximum=1000.0)
    hold_time: float = parameter(
        0.3, 'How long the last velocity is held where registration fails; after it the pose '
        'stands still.', unit='s', minimum=0.0, maximum=60.0)


@dataclass(frozen=True)
class Settings:
    """All settings of the core."""

    features: FeatureSettings = FeatureSettings()
    sensor: SensorSettings = SensorSettings()
    aick: AickSettings = AickSettings()
    refinement: RefinementSettings = RefinementSettings()
    odometry: OdometrySettings = OdometrySettings()


@dataclass(frozen=True)
class NodeSettings:
    """Settings of the ROS node around the core."""

    frame_id: str = parameter(
        'base_link', 'Frame whose motion is published (REP-105).')
    odom_frame_id: str = parameter('odom', 'Frame the pose is given in (REP-105).')
    publish_tf: bool = parameter(
        True, 'Whether to publish odom_frame_id -> frame_id on /tf.')
    camera_in_base: tuple = parameter(
        (), "Pose of the camera's optical frame in frame_id: x y z qx qy qz qw; empty: from TF.")
    initial_pose: tuple = parameter(
        (), 'Where frame_id is at the start: x y z [m] roll pitch yaw [rad]; empty: the origin.')
    guess_frame_id: str = parameter(
        '', "Frame of another odometry, the wheels' for example, whose transform to frame_id goes "
        'on where the camera is lost; TF is then published to it. Empty: none.')
    lost_policy: str = parameter(
        'hold', 'What is published while the camera is lost: the last pose without weight, a null '
        'pose, or nothing.', choices=('hold', 'null', 'silent'))
    twist_covariance: str = parameter(
        'velocity', 'Whether the covariance of the twist is that of the velocity, as the message '
        'defines it, or that of the increment since the last frame, as RTAB-Map reads it.',
        choices=('velocity', 'increment'))
    wait_for_transform: float = parameter(
        0.1, 'How long a frame waits for a transform that moves to be told up to its stamp.',
        unit='s', minimum=0.0, maximum=10.0)
    approx_sync: bool = parameter(
        True, 'Whether colour and depth may differ in stamp.')
    approx_sync_max_interval: float = parameter(
        0.02, 'Largest difference of stamps of one frame.', unit='s', minimum=0.0, maximum=1.0)
    topic_queue_size: int = parameter(
        10, 'Queue of each image subscription.', minimum=1, maximum=1000)
    sync_queue_size: int = parameter(
        5, 'Images of one topic that wait for their partner.', minimum=1, maximum=1000)
    qos_reliability: str = parameter(
        'auto', 'Reliability of the image subscriptions; auto: what the publishers offer.',
        choices=('auto', 'reliable', 'best_effort'))
    image_transport: str = parameter(
        'raw', 'Transport of the colour images: raw from rgb/image, compressed from '
        'rgb/image/compressed.', choices=('raw', 'compressed'))
    depth_transport: str = parameter(
        'raw', 'Transport of the depth images, likewise; both compressed ones are PNG.',
        choices=('raw', 'compressed', 'compressedDepth'))
    image_rectification: str = parameter(
        'auto', 'Whether images are raw (k and d of camera_info hold) or rectified (p does); '
        "auto: rectified where 'rect' is a part of the topic's name.",
        choices=('auto', 'raw', 'rectified'))
    register_depth: bool = parameter(
        False, 'Whether depth is not registered to colour yet: the node does it, with '
        'depth/camera_info.')
    depth_in_colour: tuple = parameter(
        (), "Pose of the depth camera's optical frame in the colour camera's: x y z qx qy qz qw; "
        'empty: from TF.')
    process_every_frame: bool = parameter(
        False, 'Whether every frame is registered, in order, or the newest one only.')
    max_update_rate: float = parameter(
        0.0, 'Frames registered a second at most, the others are left out evenly; 0: all.',
        unit='Hz', minimum=0.0, maximum=1000.0)


_ALL_PAPER = {'features.cell_size': 0.0, 'aick.lambda_e': 0.01, 'aick.lambda_f': 0.2,
              'refinement.mode': 'none', 'odometry.reference': 'previous'}
_FULL = {**_ALL_PAPER, 'features.max_keypoints': 0, 'aick.alpha': 0.8, 'aick.iterations': 25}
_FAST_ORB = {**_ALL_PAPER, 'features.detector': 'orb', 'features.max_keypoints': 350,
             'aick.alpha': 0.6, 'aick.iterations': 10}
_FAST_SURF = {**_ALL_PAPER, 'features.detector': 'surf', 'features.max_keypoints': 200,
              'aick.alpha': 0.3, 'aick.iterations': 5}

PRESETS: Mapping[str, Mapping[str, Any]] = {
    'paper-full': {**_FULL, 'features.detector': 'orb'},
    'paper-fast': _FAST_ORB,
    'paper-full-surf': {**_FULL, 'features.detector': 'surf'},
    'paper-fast-surf': _FAST_SURF,
    'paper-fast-words': {
        **_FAST_ORB, 'aick.vocabulary': 'orb-1000', 'aick.word_radius': 0.26},
    'paper-fast-surf-words': {
        **_FAST_SURF, 'aick.vocabulary': 'surf-1000', 'aick.word_radius': 0.26},
}
"""The paper's parameters (IV, V-A), whatever the defaults are; but R_w of ORB, which is 0.165
there, is that at which our words lose nothing."""


def parameters(group: Any) -> Iterator[Parameter]:
    """
    Yield the parameters of a group of settings, with its present values as defaults.

    :param group: an instance of one of the settings classes, or the class for its defaults.
    """
    yield from _walk(group() if isinstance(group, type) else group, '')


def values(group: Any) -> dict[str, Any]:
    """Return the present values of a group of settings under their dotted names."""
    return {p.name: p.default for p in parameters(group)}


def with_values(group: Any, changes: Mapping[str, Any]) -> Any:
    """
    Return the settings with some values changed; all are checked before any is taken.

    :param group: an instance of one of the settings classes.
    :param changes: dotted name -> value or its text.
    :raises InputError: for an unknown name or a value outside its range.
    """
    known = {p.name: p for p in parameters(group)}
    checked = {}
    for name, value in changes.items():
        if name not in known:
            raise InputError(f'no parameter is called {name!r}: {hint(name, known)}')
        checked[name] = known[name].convert(value)
    return _replace(group, '', checked)


def hint(name: str, known: Iterable[str]) -> str:
    """Return what may have been meant by a name that is not known."""
    near = difflib.get_close_matches(name, known, n=3)
    return f'did you mean {" or ".join(near)}?' if near else 'see the parameter table'


def preset(name: str) -> Settings:
    """
    Return the settings of a preset.

    :raises InputError: for an unknown name.
    """
    if name not in PRESETS:
        raise InputError(f'no preset is called {name!r}: there are {", ".join(PRESETS)}')
    return with_values(Settings(), PRESETS[name])


_TYPE_NAMES = {bool: 'true or false', int: 'a whole number', float: 'a number', str: 'text',
               tuple: 'a list of numbers'}
_TYPES = {'bool': bool, 'int': int, 'float': float, 'str': str, 'tuple': tuple}


def _walk(group: Any, prefix: str) -> Iterator[Parameter]:
    for f in dataclasses.fields(group):
        value = getattr(group, f.name)
        if dataclasses.is_dataclass(value):
            yield from _walk(value, f'{prefix}{f.name}.')
        else:
            yield Parameter(f'{prefix}{f.name}', _TYPES[f.type], value, **f.metadata)


def _replace(group: Any, prefix: str, changes: Mapping[str, Any]) -> Any:
    new = {}
    for f in dataclasses.fields(group):
        value, name = getattr(group, f.name), f'{prefix}{f.name}'
        if dataclasses.is_dataclass(value):
            new[f.name] = _replace(value, f'{name}.', changes)
        else:
            new[f.name] = changes.get(name, value)
    return type(group)(**new)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _truth(value: Any) -> bool:
    if isinstance(value, str):
        return _TRUTHS.index(value.lower()) == 1
    if not isinstance(value, bool):
        raise TypeError
    return value


def _whole_number(value: Any) -> int:
    number = _number(value)
    if not number.is_integer():
        raise ValueError
    return int(number)


def _number(value: Any) -> float:
    if isinstance(value, bool):
        raise TypeError
    return float(value)


def _numbers(value: Any) -> tuple[float, ...]:
    items = value.replace(',', ' ').split() if isinstance(value, str) else value
    return tuple(_number(item) for item in items)


_TRUTHS = ('false', 'true')
_CONVERTERS = {bool: _truth, int: _whole_number, float: _number, str: _text, tuple: _numbers}
