# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The one kind of error a user can mend: input that cannot be used."""


class InputError(ValueError):
    """Input that cannot be used; the message says what, where and what to do."""
