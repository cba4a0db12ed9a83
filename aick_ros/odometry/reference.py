# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The frames that a new frame is registered to."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry.pose import PoseWithCovariance, at_point, in_axes
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.registration.result import Registration, SensorBias

# chosen on a rendered camera that is lifted while a hand covers it
_EARLIER_FRAMES = 3
_EARLIER_SPACING = 0.3  # s; chosen likewise

_OWN_NOISE = 0.5  # derived: share of the variance of a registration that is not the keyframe's

_OWN_NOISE_OF_COLOUR = 0.15
"""The same by colour alone: most is of the depth of the keyframe. Chosen; 0.06 to 0.15 on four
kinds of rendered cameras and two excerpts of real recordings."""

_LONGEST_BLUR = 5.0  # s; chosen: what stays blurred for longer is how the camera sees

_EARLIER_DEPTH_REFERENCES = 4  # chosen: those of one time without keypoints that are remembered

_MAX_ATTEMPTS = 3
"""Most registrations per frame, chosen: one that fails costs about 45 ms, mostly in AICK."""


@dataclass(frozen=True, eq=False)
class Loss:
    """
    What was known when a frame was lost.

    :param last: the last frame that was tracked before.
    :param twist: body velocity of the camera there [m/s, rad/s]; None: unknown.
    """

    last: Reference
    twist: np.ndarray | None


@dataclass(frozen=True, eq=False)
class Reference:
    """
    A frame with its pose.

    :param pose: ``T_reckoned_camera`` of the image, whenever it was taken: errors of stamps do not
        add up from image to image.
    :param in_keyframe: ``T_keyframe_camera`` of the two images as registered, with the covariance
        of all but biases; None: the frame is a keyframe itself. By depth alone, the pose in the
        frame whose depth it was registered to.
    :param bias: between keypoints and depth, of that registration; None where it has none.
    :param by_readout: 6, of that registration: its errors by the readout of colour [m/s, rad/s].
    :param loss: of a frame that was lost, what was known before: what is registered to that frame
        may follow something that moves in front of the camera, or depth that is wrong in both;
        None for other frames.
    :param is_by_colour: whether it was registered to the keyframe by colour alone.
    """

    prepared: PreparedFrame
    pose: PoseWithCovariance
    in_keyframe: PoseWithCovariance | None = None
    bias: SensorBias | None = None
    by_readout: np.ndarray = field(default_factory=lambda: np.zeros(6))
    loss: Loss | None = None
    is_by_colour: bool = False

    @property
    def stamp(self) -> int:
        """Stamp of the frame [ns]."""
        return self.prepared.stamp

    def bare(self) -> Reference:
        """Return the frame without the images that registrations to it do not need."""
        return replaced(self, prepared=self.prepared.bare())

    def motion_to(self, registration: Registration
                  ) -> tuple[PoseWithCovariance, SensorBias | None]:
        """
        Return the motion from this image to another one registered to the same keyframe.

        The noise of the keyframe is in both registrations, about half of each variance, and
        cancels. The bias that both have in common is not in the difference of their biases either.
        From the keyframe itself one registration shows the bias, so that an unusual one counts.
        By depth alone all of it is depth's, and what changes of it is in proportion to the motion.
        By colour alone none is depth's: two frames have it in common, and the noise of the depth
        of the keyframe; between such a frame and another one all of it counts.

        :param registration: of the other frame, ``T_keyframe_camera``.
        :returns: ``T_camera0_camera1``, with the covariance of all but the bias and errors of
            stamps, and the difference of the two biases in the same axes; None where one of them
            is not known.
        """
        if self.in_keyframe is None:
            is_bias_known = registration.bias is not None or registration.is_by_depth
            return (registration.varying_pose if is_bias_known
                    else registration.image_pose), registration.bias
        motion = registration.unbiased_pose.relative_to(self.in_keyframe)
        own, systematic = _OWN_NOISE, np.zeros((6, 6))
        if registration.is_by_colour and self.is_by_colour:
            own = _OWN_NOISE_OF_COLOUR
        elif registration.is_by_colour or self.is_by_colour:
            systematic = registration.systematic
        bias = None
        if self.bias is not None and registration.bias is not None:
            arm = registration.T_target_source[:3, 3] - self.in_keyframe.translation
            bias = registration.bias.since(self.bias, arm, _OWN_NOISE, self.in_keyframe.rotation)
        return motion.with_covariance(own * motion.covariance + systematic), bias

    def readout_error(self, registration: Registration) -> np.ndarray:
        """
        Return by how much :meth:`motion_to` errs by the readout of colour, 6 [m/s, rad/s].

        Two registrations to one keyframe have in common what its velocity makes of it.
        """
        if self.in_keyframe is None:
            return registration.by_readout
        arm = registration.T_target_source[:3, 3] - self.in_keyframe.translation
        error: np.ndarray = in_axes(self.in_keyframe.rotation.T) @ (
            registration.by_readout - at_point(arm) @ self.by_readout)
        return error


class References:
    """
    The keyframe, the last tracked frame, earlier ones and the last lost one.

    While frames are registered by depth alone the keyframe stays, for keypoints that are seen
    again. The depth reference is what they are registered to: the last frame with keypoints, and
    where that is out of view a later one; None while there are keypoints. Those before it are
    kept too.

    While the image is blurred, blurred frames may have to be keyframes. The last one that was
    sharp is kept: what is seen after the blur is registered to what was seen before it.

    Frames that were lost may agree with each other and still be wrong. The last frame before them
    is kept until a frame is registered to it, or to one before it.

    The keyframe and the earlier frames are kept without the images that registrations to them do
    not need. The last frame, which the next one may repeat, and depth references keep all of
    theirs.

    :param first: a frame that is the keyframe and the last tracked frame in one.
    """

    def __init__(self, first: Reference) -> None:
        self.last = first
        self.keyframe = self.sharp = first.bare()
        self.depth_reference: Reference | None = None
        self.earlier_depth_references: deque[Reference] = deque(maxlen=_EARLIER_DEPTH_REFERENCES)
        self._earlier: deque[Reference] = deque(maxlen=_EARLIER_FRAMES)
        self._lost: Reference | None = None
        self.lost_in_the_dark: Reference | None = None
        self._turn = 0
        self.loss: Loss | None = None
        self.is_lost = False
        """Loss of the frame before, also of one that is not kept."""

    def track(self, last: Reference, keyframe: Reference) -> None:
        """Advance to a tracked frame and the keyframe that the next one is registered to."""
        spacing = _EARLIER_SPACING * NANOSECONDS
        if not self._earlier or self.last.stamp - self._earlier[-1].stamp >= spacing:
            self._earlier.append(self.last.bare())
        if keyframe.stamp != self.keyframe.stamp and not (
                keyframe.stamp - self.sharp.stamp < _LONGEST_BLUR * NANOSECONDS
                and keyframe.prepared.is_blurred_beside(self.sharp.prepared)):
            self.sharp = keyframe
        if keyframe.stamp == self.sharp.stamp:
            self.sharp = keyframe  # it may have been corrected again
        self.keyframe, self.last, self.depth_reference = keyframe, last, None
        self.earlier_depth_references.clear()
        self._lost, self.lost_in_the_dark, self._turn = None, None, 0
        self.is_lost = False

    def track_by_depth(self, last: Reference, reference: Reference) -> None:
        """Advance to a frame that was registered to the depth image of another."""
        if self.depth_reference is not None and reference is not self.depth_reference:
            self.earlier_depth_references.append(self.depth_reference)
        self.last, self.depth_reference = last, reference
        self._lost, self.lost_in_the_dark, self._turn = None, None, 0
        self.is_lost = False

    def lose(self, lost: Reference) -> None:
        """Keep a lost frame: the next one may show the same place."""
        self._turn += self._lost is not None
        self._lost, self.lost_in_the_dark, self.loss = lost, None, lost.loss

    def lose_in_the_dark(self, lost: Reference) -> None:
        """Keep a frame that was lost without keypoints: the next may show the same surfaces."""
        self.lost_in_the_dark, self.loss = lost, lost.loss

    def loss_before(self, stamp: int, twist: np.ndarray | None, model: MotionModel) -> Loss:
        """
        Return what was known before a loss, or before an earlier one that is still in doubt.

        :param stamp: of the frame that is lost [ns].
        :param twist: body velocity at the last frame [m/s, rad/s]; None: unknown.
        """
        if self.loss is not None and model.holds(seconds(self.loss.last.stamp, stamp)):
            return self.loss
        holds = model.holds(seconds(self.last.stamp, stamp))
        return Loss(self.last.bare(), twist if holds else None)

    def confirm(self, reference: Reference) -> None:
        """Forget the loss, if the reference that a frame was registered to is from before it."""
        if self.loss is not None and reference.stamp <= self.loss.last.stamp:
            self.loss = None

    def are_linked(self, stamp: int, other: int) -> bool:
        """Return whether the motion between frames with two stamps [ns] was measured."""
        return self.loss is None or (
            (stamp > self.loss.last.stamp) == (other > self.loss.last.stamp))

    def is_blurred(self) -> bool:
        """Return whether the keyframe is blurred beyond use, beside the one before the blur."""
        return self.keyframe.stamp != self.sharp.stamp

    def is_return_to(self, reference: Reference) -> bool:
        """Return whether a frame registered to a reference ends depth-only mode or a blur."""
        return self.depth_reference is not None or self.is_blurred() and reference is self.sharp

    def depth_references(self) -> Iterator[Reference]:
        """Yield what to register a frame to by depth alone."""
        if self.depth_reference is not None:
            yield self.depth_reference
        if self.last is not self.depth_reference:
            yield self.last

    def candidates(self, prepared: PreparedFrame) -> Iterator[Reference]:
        """
        Yield what to register a frame to until one registration is accepted, a few at most.

        A frame that is sharp again is compared with the last sharp keyframe before a blurred one.
        After the keyframe come the last frame before a loss, the last tracked frame and earlier
        ones, the newest first. While lost frames follow each other, these take turns, and the last
        lost frame comes at the end.
        """
        is_sharp = self.is_blurred() and not prepared.is_blurred_beside(self.sharp.prepared)
        first = [self.sharp, self.keyframe] if is_sharp else [self.keyframe]
        at_the_end = [] if self._lost is None else [self._lost]
        before = [] if self.loss is None else [self.loss.last]
        known = {reference.stamp for reference in first}
        others = {reference.stamp: reference
                  for reference in (*before, self.last, *reversed(self._earlier))
                  if reference.stamp not in known}
        in_turn = deque(others.values())
        in_turn.rotate(-self._turn)
        yield from first
        yield from list(in_turn)[:_MAX_ATTEMPTS - len(first) - len(at_the_end)]
        yield from at_the_end
