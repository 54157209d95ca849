"""``python -m autograder.observe``: the reference for authors, made from the docstrings."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from typing import Any

from autograder import observe
    observe.ObservedNode, Span, Change, observe.in_context, observe.Choices, observe.Question,
    SteppedObserver, SteppedGoal, MergedSubscription, require_stream, StreamRate, SteppedTrials,
