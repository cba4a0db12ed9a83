# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages that wait in the queue of a subscription."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rclpy.subscription import Subscription


def waiting_messages(subscription: Subscription) -> Iterator[Any]:
    """Take the messages that wait in the queue of a subscription, as the executor does."""
    with subscription.handle:
        while (taken := subscription.handle.take_message(
                subscription.msg_type, subscription.raw)) is not None:
            yield taken[0]
