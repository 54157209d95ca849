"""A small bank with every kind of question, written to a folder of its own.

What may not reach a learner before submission carries the mark `SECRET`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

KINDS = ("predict", "multiple", "numeric", "ordering", "matching")
NAME = "sample"
SECRET = "KEYMARK"
BELIEF = f"{SECRET.lower()}-belief"


def option(text: str, *, correct: bool = False) -> dict[str, Any]:
    if correct:
        return {"text": text, "correct": True, "feedback": f"{SECRET} why {text} is right."}
    return {
        "text": text, "misconception": BELIEF, "feedback": f"{SECRET} why {text} is wrong.",
        "show": f"print('{SECRET}', {text!r})",
    }  # fmt: skip


def built(**fields: Any) -> dict[str, Any]:
    return {
        **fields, "feedback": f"{SECRET} well made.", "wrong_feedback": f"{SECRET} not so.",
        "misconception": BELIEF, "show": f"print('{SECRET}')",
    }  # fmt: skip


def questions(kind: str, number: int) -> dict[str, Any]:
    """Return what is special to one variant of a kind."""
    if kind == "numeric":
        return {
            "answer": 2.5 * number, "tolerance": 0.1, "unit": "s",
            "feedback": f"{SECRET} so it is.", "wrong_feedback": f"{SECRET} no such number.",
            "traps": [{
                "value": 100.0, "tolerance": 0.5, "misconception": BELIEF,
                "feedback": f"{SECRET} that is the rate.", "show": "print('rate')",
            }],
        }  # fmt: skip
    if kind == "ordering":
        return built(
            items=[f"step {step} of `{number}`" for step in ("one", "two", "three", "four")]
        )
    if kind == "matching":
        pairs = [{"left": f"left {side} {number}", "right": f"right {side}"} for side in "xyz"]
        return built(pairs=pairs, extras=["right of none"])
    texts = [
        f"**{word}** $x^{number}$ <b>{kind}</b>" for word in ("alpha", "beta", "gamma", "delta")
    ]
    right = {"alpha", "gamma"} if kind == "multiple" else {"gamma"}
    options = [option(text, correct=any(word in text for word in right)) for text in texts]
    return {"options": options, **({"code": "print(6 * 7)"} if kind == "predict" else {})}


def variant(kind: str, number: int) -> dict[str, Any]:
    return {
        "id": f"{kind}-{number}", "kind": kind, "proof": "test_nothing",
        "stem": f"Stem {number} with `code`, $\\frac{{1}}{{2}}$ and <script>alert(1)</script>\n\n"
        "```python\nfor i in range(3):\n    print(i)\n```\n\n![a dot](assets/dot.svg)\n",
        **questions(kind, number),
    }  # fmt: skip


def data(kinds: tuple[str, ...] = KINDS) -> dict[str, Any]:
    return {
        "quiz": NAME, "title": "A sample & <i>more</i>", "chapter": "Chapter 0",
        "pass_mark": len(kinds) - 1 or 1,
        "misconceptions": {BELIEF: "A belief."},
        "concepts": [
            {"id": kind, "objective": f"Answer {kind} questions.",
             "variants": [variant(kind, number) for number in range(1, 5)]}
            for kind in kinds
        ],
    }  # fmt: skip


def write(folder: Path, content: dict[str, Any] | None = None) -> Path:
    """Write the bank into ``folder``; return its file."""
    (folder / "assets").mkdir(parents=True, exist_ok=True)
    (folder / "assets" / "dot.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="40" height="40">'
        '<circle cx="20" cy="20" r="9" fill="#36c"/></svg>'
    )
    path = folder / f"{NAME}.yaml"
    path.write_text(yaml.safe_dump(content or data(), allow_unicode=True, sort_keys=False))
    return path
