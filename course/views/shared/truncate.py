"""Cutting what is shown to a size that fits, with a mark where something was left out."""

from __future__ import annotations

import json
from typing import Any


def cut_text(whole: str, most: int) -> str:
    """Return the first ``most`` characters, and how many were left out."""
    return whole if len(whole) <= most else f"{whole[:most]}… [{len(whole) - most} more characters]"


def cut_data(whole: Any, most: int) -> Any:
    """Return plain data cut to about ``most`` bytes of JSON; what was left out is counted."""
    return _cut_value(whole, [most])


def _cut_value(whole: Any, left: list[int]) -> Any:
    """Cut what is more than ``left[0]`` bytes, and take what is kept off it."""
    if isinstance(whole, dict):
        kept: dict[str, Any] = {}
        for key, value in whole.items():
            if left[0] <= 0:
                kept["…"] = f"{len(whole) - len(kept)} more"
                break
            left[0] -= len(key)
            kept[key] = _cut_value(value, left)
        return kept
    if isinstance(whole, list):
        items: list[Any] = []
        for value in whole:
            if left[0] <= 0:
                return [*items, f"… {len(whole) - len(items)} more"]
            items.append(_cut_value(value, left))
        return items
    if isinstance(whole, str):
        # Beyond ASCII a character takes up to 12 bytes of JSON.
        share = max(16, left[0] if whole.isascii() else left[0] // 6)
        whole = cut_text(whole, share)
    left[0] -= len(json.dumps(whole))
    return whole
