"""Submissions that are alike: a hint where to look, never a verdict."""
