"""The reference for authors is what the docstrings say, and its examples run."""

from __future__ import annotations

import doctest

import pytest

from autograder.corpus import mutations
    [mutations, node_graph, nouns, observed_node, process_usage, stepped_rate, wall_rate],
