"""The reference for authors is what the docstrings say, and its examples run."""

from __future__ import annotations

import doctest

import pytest

from autograder.corpus import mutations
from autograder.observe import (
    "module",
    [
        choices, findings, merged_subscriptions, mutations, name_patterns, nouns, observed_node,
        stream_rate,
    ],
)  # fmt: skip
