# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
All parameters of the algorithm: name, default, range, unit and description of each.

The ROS parameters, ``--set``, the YAML file and the documented table are generated from these
dataclasses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from aick_ros.errors import InputError
from aick_ros.settings.features import FeatureSettings
from aick_ros.settings.parameter import Checked, parameter


@dataclass(frozen=True)
class SensorSettings(Checked):
    """Range and noise of the depth camera, and the part of the images that is used."""

    min_depth: float = parameter(
        0.1, 'Minimum valid depth.', unit='m', minimum=0.0, maximum=100.0)
    max_depth: float = parameter(
        10.0, 'Maximum valid depth.', unit='m', minimum=0.1, maximum=1000.0)
    depth_sigma: float = parameter(
        0.0015, 'Standard deviation of the depth at one metre.',
        unit='m', minimum=1e-6, maximum=1.0)
    depth_exponent: float = parameter(
        2.0, 'Exponent p of the depth noise: sigma = depth_sigma * depth^p; 2 for structured '
        'light and stereo, 0 to 1 for time of flight.', minimum=0.0, maximum=4.0)
    depth_scale_sigma: float = parameter(
        0.005, 'Standard deviation of the scale error of depth, a share that all depths have in '
        'common. Images cannot show it; it is added to the covariance of translations. 0: the '
        'scale is exact.', minimum=0.0, maximum=0.3)
    depth_jump: float = parameter(
        0.02, 'Minimum relative depth difference between neighbouring pixels at a depth edge.',
        minimum=0.001, maximum=1.0)
    mask: str = parameter(
        '', 'Image that hides a part of the colour and the depth image, as where they show the '
        'robot itself: the path of a PNG file with one channel of 8 bits, 0 where images are not '
        'used, of the size of the colour image or with the same ratio of width to height. Empty: '
        'they are used everywhere.')
    roi_ratios: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0), 'Shares of both images at the left, right, top and bottom that are '
        'not used.')

    def __post_init__(self) -> None:
        """Reject an empty depth range too, and shares that leave nothing."""
        super().__post_init__()
        shares = self.roi_ratios
        if (len(shares) != 4 or not all(0.0 <= share < 1.0 for share in shares)
                or sum(shares[:2]) >= 1.0 or sum(shares[2:]) >= 1.0):
            raise InputError(f'sensor.roi_ratios = {list(shares)}: four shares are required, left '
                             'right top bottom, from 0 to less than 1, that leave a part of the '
                             'images')
        if self.min_depth >= self.max_depth:
            raise InputError(f'sensor.min_depth = {self.min_depth:g} m and sensor.max_depth = '
                             f'{self.max_depth:g} m: the first must be less than the second')

    @property
    def inverse_depth_exponent(self) -> float:
        """Exponent q of the noise of inverse depth: sigma = depth_sigma * depth^q."""
        return self.depth_exponent - 2.0  # derived: d(1/z) = dz / z^2

    @property
    def without_mask(self) -> SensorSettings:
        """The same settings for frames that are masked already."""
        return replace(self, mask='', roi_ratios=(0.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True)
class MisalignmentSettings(Checked):
    """
    Known misalignment of the depth images to the colour images, measured by ``aick noise``.

    The offset is the twist whose exponential is ``T_colour_depth``, of depth images that are taken
    for registered to colour.
    """

    x: float = parameter(
        0.0, 'Offset of depth to colour along x, of images that are taken for registered.',
        unit='m', minimum=-0.2, maximum=0.2)
    y: float = parameter(
        0.0, 'Offset of depth to colour along y.', unit='m', minimum=-0.2, maximum=0.2)
    z: float = parameter(
        0.0, 'Offset of depth to colour along z.', unit='m', minimum=-0.2, maximum=0.2)
    rot_x: float = parameter(
        0.0, 'Rotation of depth to colour about x.', unit='rad', minimum=-0.3, maximum=0.3)
    rot_y: float = parameter(
        0.0, 'Rotation of depth to colour about y.', unit='rad', minimum=-0.3, maximum=0.3)
    rot_z: float = parameter(
        0.0, 'Rotation of depth to colour about z.', unit='rad', minimum=-0.3, maximum=0.3)
    delay: float = parameter(
        0.0, 'Time by which depth images are taken later than their stamps say.', unit='s',
        minimum=-0.1, maximum=0.1)
    colour_readout: float = parameter(
        0.0, 'Time that a rolling shutter takes from the first row of colour images to the last.',
        unit='s', minimum=-0.1, maximum=0.1)
    depth_readout: float = parameter(
        0.0, 'The same of depth images; a Kinect has both, a global shutter none.', unit='s',
        minimum=-0.1, maximum=0.1)
    colour_focal: float = parameter(
        0.0, 'Error of the focal length of the colour image: the true one is longer by this '
        'share.', minimum=-0.3, maximum=0.3)
    depth_focal: float = parameter(
        0.0, 'The same of the depth image, where it was not registered.', minimum=-0.3,
        maximum=0.3)
    colour_radial: float = parameter(
        0.0, 'First radial coefficient (k1) of the lens of the colour camera, beside those of its '
        'calibration.', minimum=-0.3, maximum=0.3)


@dataclass(frozen=True)
class AickSettings(Checked):
    """Adaptive Iterative Closest Keypoint (III-A)."""

    alpha: float = parameter(
        0.6, 'Decay rate of the descriptor weight: w = alpha^i in iteration i.',
        minimum=0.0, maximum=1.0)
    iterations: int = parameter(10, 'Number of iterations.', minimum=1, maximum=100)
    lambda_e: float = parameter(
        0.01, 'Threshold on the Euclidean distance of a match (Eq. 2): at weight w a match is '
        'closer than (1 - w) * lambda_e + w * lambda_f.', unit='m', minimum=1e-4, maximum=10.0)
    lambda_f: float = parameter(
        0.2, 'Threshold on the descriptor distance of a match (Eq. 2): squared L2 distance, or '
        'the fraction of differing bits.', minimum=1e-3, maximum=10.0)
    vocabulary: str = parameter(
        '', 'Vocabulary of the fast search (III-B): a file, or the name of a vocabulary shipped '
        'with the package. Empty: exhaustive search.')
    word_radius: float = parameter(
        0.26, 'R_w: a keypoint is indexed under each visual word at a smaller descriptor distance '
        '(as in lambda_f); above 4: under every word.', minimum=0.0, maximum=10.0)


@dataclass(frozen=True)
class RefinementSettings(Checked):
    """Least-squares refinement of the pose found by AICK."""

    mode: str = parameter(
        'joint', 'none: no refinement (the paper); keypoints: reprojection error of keypoints '
        'tracked with sub-pixel accuracy; joint: also point-to-plane distances of the depth '
        'images.', choices=('none', 'keypoints', 'joint'))
    iterations: int = parameter(
        3, 'Maximum number of iterations.', minimum=1, maximum=100)
    max_tracks: int = parameter(
        400, 'Maximum number of tracked keypoints: the strongest.',
        minimum=3, maximum=20000)
    track_window: int = parameter(
        9, 'Side length of the tracking window.', unit='px', minimum=5, maximum=51)
    track_sigma: float = parameter(
        0.6, 'Standard deviation of a tracked position.', unit='px', minimum=0.01, maximum=10.0)
    surface_points: int = parameter(
        2000, 'Maximum number of points taken from the depth image.', minimum=10, maximum=100000)
    reach: float = parameter(
        0.1, 'Maximum distance between a point and its corresponding plane.',
        unit='m', minimum=0.001, maximum=10.0)
    robust_width: float = parameter(
        2.0, 'Normalised residual (in standard deviations) at which the robust weight is 1/4.',
        minimum=0.5, maximum=100.0)

    def sought(self, count: int) -> int:
        """Return how many of so many keypoints support a pose, if all are found."""
        return count if self.mode == 'none' else min(count, self.max_tracks)


@dataclass(frozen=True)
class OdometrySettings(Checked):
    """Reference frame of the registrations, acceptance gates, and prediction after a failure."""

    reference: str = parameter(
        'keyframe', 'Reference of each registration: the previous frame (the paper), or a '
        'keyframe.',
        choices=('previous', 'keyframe'))
    aick_interval: int = parameter(
        1, 'Every so many frames, and where the keyframe is replaced, AICK checks the pose of '
        'frames that are registered by keypoints tracked from the keyframe, and decides where '
        'too few of them are found; the others need no keypoints of their own. 1: AICK registers '
        'every frame.', unit='frames', minimum=1, maximum=1000)
    min_overlap: float = parameter(
        0.7, 'Minimum fraction of keypoints matched to the keyframe; below it the keyframe is '
        'replaced.', minimum=0.0, maximum=1.0)
    min_matches: int = parameter(
        12, 'Minimum number of keypoints that support an accepted registration: those tracked, or '
        'the matches of AICK where refinement.mode is none.', minimum=3, maximum=10000)
    max_speed: float = parameter(
        3.0, 'Maximum speed of an accepted motion.', unit='m/s', minimum=0.01, maximum=1000.0)
    max_turn_rate: float = parameter(
        6.0, 'Maximum angular speed of an accepted motion.',
        unit='rad/s', minimum=0.01, maximum=1000.0)
    hold_time: float = parameter(
        0.3, 'How long the pose is predicted at constant velocity after registration fails; then '
        'it is held.', unit='s', minimum=0.0, maximum=60.0)
    acceleration_sigma: float = parameter(
        3.0, 'Acceleration noise (1 sigma) of the constant-velocity model.', unit='m/s^2',
        minimum=0.001, maximum=1000.0)
    angular_acceleration_sigma: float = parameter(
        15.0, 'Angular acceleration noise (1 sigma) of the constant-velocity model.',
        unit='rad/s^2', minimum=0.001, maximum=10000.0)
    motion_prior: bool = parameter(
        True, 'Whether positions that are uncertain are held by the velocity before, within '
        '`acceleration_sigma`.')
    guess_slip: float = parameter(
        0.1, 'Standard deviation of a motion by another odometry (the wheels), as a fraction of '
        'it.', minimum=0.0, maximum=10.0)
    guess_sigma: float = parameter(
        0.01, 'Added to it, in metres and in radians.', minimum=1e-5, maximum=10.0)
    planar: bool = parameter(
        False, 'Whether the base moves in a plane, as a robot on wheels does: along its x and y '
        'axes at the start.')
    planar_sigma: float = parameter(
        0.005, 'Standard deviation of the height of a planar base above the plane.', unit='m',
        minimum=1e-5, maximum=1.0)
    planar_tilt_sigma: float = parameter(
        0.005, 'Standard deviation of roll and pitch of a planar base.', unit='rad', minimum=1e-5,
        maximum=1.0)
    max_keyframes: int = parameter(
        30, 'Maximum number of keyframes that are kept to be found again; 0 keeps none: the '
        'drift is not corrected.', minimum=0, maximum=1000)
    keyframe_megabytes: float = parameter(
        100.0, 'Maximum memory of the keyframes that are kept; one takes 2 MB at 640x480. It is '
        'taken with the first frame.', unit='MB', minimum=1.0, maximum=100000.0)
    reuse_distance: float = parameter(
        0.8, 'Maximum distance at which a keyframe is sought again.', unit='m', minimum=0.01,
        maximum=10.0)
    reuse_angle: float = parameter(
        0.7, 'Maximum angle at which a keyframe is sought again.', unit='rad', minimum=0.01,
        maximum=3.2)
    reuse_age: float = parameter(
        2.0, 'Minimum age of a keyframe that is sought again.', unit='s', minimum=0.0,
        maximum=3600.0)
    reuse_interval: float = parameter(
        0.5, 'Minimum time between two searches, each of two registrations at most.', unit='s',
        minimum=0.0, maximum=3600.0)
    correction_step: float = parameter(
        0.002, 'Maximum correction of the position per frame.', unit='m', minimum=1e-5,
        maximum=10.0)
    correction_turn: float = parameter(
        0.0017, 'Maximum correction of the orientation per frame.', unit='rad', minimum=1e-5,
        maximum=3.2)


@dataclass(frozen=True)
class ImuSettings(Checked):
    """Noise of the IMU, where the frames have its samples; defaults suit those of cameras."""

    gyroscope_noise: float = parameter(
        0.00025, 'Noise density of the gyroscope: by default that of a BMI055 or BMI085.',
        unit='rad/s/sqrt(Hz)', minimum=1e-7, maximum=1.0)
    gyroscope_bias_walk: float = parameter(
        3e-5, 'Random walk of the bias of the gyroscope.', unit='rad/s^2/sqrt(Hz)', minimum=0.0,
        maximum=1.0)
    gyroscope_bias_sigma: float = parameter(
        0.02, 'Standard deviation of the bias of the gyroscope at the start.', unit='rad/s',
        minimum=0.0, maximum=1.0)
    gyroscope_scale_sigma: float = parameter(
        0.01, 'Standard deviation of the scale of the axes of a gyroscope that was not '
        'calibrated, and of what one sees of the others; whether it was, and the rest, is '
        'estimated. 0: they are exact.', minimum=0.0, maximum=0.1)
    mounting_sigma: float = parameter(
        0.0175, 'Standard deviation of the rotation of the gyroscope in the camera, about each '
        'axis, where that was not calibrated; estimated likewise. 0: it is exact.', unit='rad',
        minimum=0.0, maximum=0.1)
    gravity: bool = parameter(
        True, 'Whether `odom` begins level, with z up, and is kept so, where an accelerometer '
        'has measured before the first frame.')
    level_wait: float = parameter(
        10.0, 'Longest time that the poses of a recording, or of a node with '
        '`wait_level_to_init`, are held back for `odom` to begin level by what is measured '
        'meanwhile. 0: it begins level by the first accelerations alone.', unit='s', minimum=0.0,
        maximum=600.0)
    level_sigma: float = parameter(
        0.005, 'Standard deviation of the direction of gravity from which on they are no longer '
        'held back.', unit='rad', minimum=1e-5, maximum=1.0)
    accelerometer_noise: float = parameter(
        0.02, 'Noise density of the accelerometer.', unit='m/s^2/sqrt(Hz)', minimum=1e-6,
        maximum=10.0)
    accelerometer_bias_walk: float = parameter(
        2e-4, 'Random walk of the bias of the accelerometer.', unit='m/s^3/sqrt(Hz)', minimum=0.0,
        maximum=10.0)
    accelerometer_bias_sigma: float = parameter(
        0.7, 'Standard deviation of the bias of the accelerometer at the start.', unit='m/s^2',
        minimum=0.0, maximum=10.0)
    position_sigma: float = parameter(
        0.1, 'Standard deviation of the position of the accelerometer in the camera, along each '
        'axis, where its transform has no translation; it is estimated then. 0: it is at the '
        'camera.', unit='m', minimum=0.0, maximum=10.0)
    dead_reckoning_sigma: float = parameter(
        0.3, 'Standard deviation of the position up to which gyroscope and accelerometer carry it '
        'through frames without usable images, and TF with it. 0: they do not.', unit='m',
        minimum=0.0, maximum=100.0)
    time_offset: float = parameter(
        0.0, 'Time added to the stamps of the images to get those of the IMU.', unit='s',
        minimum=-0.5, maximum=0.5)
    time_offset_sigma: float = parameter(
        0.005, 'Standard deviation of the time offset; the rest is estimated. 0: it is exact.',
        unit='s', minimum=0.0, maximum=0.1)


class PreparationSettings(NamedTuple):
    """
    What the preparation of frames depends on: those prepared by others cannot be compared.

    :param surface_points: maximum number of points of a surface; None: there are no surfaces.
    """

    features: FeatureSettings
    sensor: SensorSettings
    vocabulary: str
    word_radius: float
    surface_points: int | None


@dataclass(frozen=True)
class Settings(Checked):
    """All settings of the algorithm."""

    features: FeatureSettings = FeatureSettings()
    sensor: SensorSettings = SensorSettings()
    misalignment: MisalignmentSettings = MisalignmentSettings()
    aick: AickSettings = AickSettings()
    refinement: RefinementSettings = RefinementSettings()
    odometry: OdometrySettings = OdometrySettings()
    imu: ImuSettings = ImuSettings()

    @property
    def files(self) -> tuple[str, str]:
        """Names of the files that are read; '' where none is."""
        return self.aick.vocabulary, self.sensor.mask

    @property
    def preparation(self) -> PreparationSettings:
        """Those of the preparation of frames."""
        return PreparationSettings(
            self.features, self.sensor, self.aick.vocabulary, self.aick.word_radius,
            self.refinement.surface_points if self.refinement.mode == 'joint' else None)
