# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sentences for the log and /diagnostics."""

from __future__ import annotations


def joined(*sentences: str) -> str:
    """Return those sentences that say something as one, '' where none does."""
    return '; '.join(filter(None, sentences))
