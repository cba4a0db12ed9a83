# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Every parameter of the core once: name, default, range, unit and one sentence.

ROS parameters, ``--set``, the YAML file and the README's table are all made from these
dataclasses.
"""

from __future__ import annotations

from dataclasses import dataclass

from aick_ros.errors import InputError
from aick_ros.settings.parameter import parameter


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
    pixel_sigma: float = parameter(
        0.45, 'Standard deviation of the place of a keypoint at the finest scale.',
        unit='px', minimum=0.01, maximum=10.0)
    pixel_exponent: float = parameter(
        0.75, 'Power of the scale of a keypoint that the standard deviation of its place grows '
        'with.', minimum=0.0, maximum=2.0)


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
    pixel_sigma: float = parameter(
        0.25, 'Standard deviation of the place of a keypoint at the finest scale.',
        unit='px', minimum=0.01, maximum=10.0)
    pixel_exponent: float = parameter(
        0.75, 'Power of the scale of a keypoint that the standard deviation of its place grows '
        'with.', minimum=0.0, maximum=2.0)


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
    pixel_sigma: float = parameter(
        0.15, 'Standard deviation of the place of a keypoint at the finest scale.',
        unit='px', minimum=0.01, maximum=10.0)
    pixel_exponent: float = parameter(
        0.4, 'Power of the scale of a keypoint that the standard deviation of its place grows '
        'with.', minimum=0.0, maximum=2.0)


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
    orb: OrbSettings = OrbSettings()
    surf: SurfSettings = SurfSettings()
    sift: SiftSettings = SiftSettings()

    @property
    def chosen(self) -> OrbSettings | SurfSettings | SiftSettings:
        """The parameters of the detector."""
        return getattr(self, self.detector)


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
        'package; without one, and with a map, all keypoints are compared with all.')
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
    iterations: int = parameter(3, 'Most iterations.', minimum=1, maximum=100)
    max_tracks: int = parameter(
        400, 'Keypoints that are tracked, the strongest, or of a map the oldest.',
        minimum=3, maximum=20000)
    track_window: int = parameter(
        9, 'Side of the window that is tracked.', unit='px', minimum=5, maximum=51)
    track_sigma: float = parameter(
        0.6, 'Standard deviation of a tracked keypoint.', unit='px', minimum=0.01, maximum=10.0)
    surface_points: int = parameter(
        2000, 'Points of the depth image that are used.', minimum=10, maximum=100000)
    reach: float = parameter(
        0.1, 'Farthest distance of a point from its plane.', unit='m', minimum=0.001,
        maximum=10.0)
    robust_width: float = parameter(
        2.0, 'Residual whose weight is a quarter, in standard deviations.', minimum=0.5,
        maximum=100.0)


@dataclass(frozen=True)
class OdometrySettings:
    """Which registrations the odometry believes, and what it does without one."""

    reference: str = parameter(
        'keyframe', 'What a frame is registered to: the previous frame, one that is kept while it '
        'serves, or a map of keypoints fused over the last keyframes (a keyframe without '
        'refinement).',
        choices=('previous', 'keyframe', 'map'))
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
    acceleration_sigma: float = parameter(
        3.0, 'Acceleration noise (1 sigma) of the constant-velocity model.', unit='m/s^2',
        minimum=0.001, maximum=1000.0)
    angular_acceleration_sigma: float = parameter(
        15.0, 'Angular acceleration noise (1 sigma) of the constant-velocity model.',
        unit='rad/s^2', minimum=0.001, maximum=10000.0)


@dataclass(frozen=True)
class Settings:
    """All settings of the core."""

    features: FeatureSettings = FeatureSettings()
    sensor: SensorSettings = SensorSettings()
    aick: AickSettings = AickSettings()
    refinement: RefinementSettings = RefinementSettings()
    odometry: OdometrySettings = OdometrySettings()
