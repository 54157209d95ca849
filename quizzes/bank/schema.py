"""The format of a bank for those who write one: as a page in Markdown, and as JSON Schema."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from quizzes.bank.bank_fields import TO_TEACH
from quizzes.bank.contents import COUNTED, MIN_VARIANTS, Bank
from quizzes.bank.faults import KINDS

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
"""Banks that the page shows whole."""

_HEAD = f"""\
# The format of a quiz

Printed by `autograder quiz schema`. A quiz is one YAML file, its *bank*, called `NAME.yaml`. There
are two sorts. One that **teaches** gives feedback at once and can be taken again; each concept has
at least {MIN_VARIANTS} questions, and each wrong answer a reason. A **closed** one (`closed: true`)
examines: students get the questions alone, and all that is marked "to teach" below can be left
out.

- A learner gets one question of each concept, one point each. The best of {COUNTED} attempts
  counts, of a closed quiz the one attempt, unless `attempts` says it.
- Texts are Markdown: fenced code, `$LaTeX$`, and pictures `![what it shows](assets/NAME.svg)` that
  lie beside the bank.
- Put a text in quotes if it is a number, `true`, `false` or `null`, or has `: ` or ` #` in it, or
  begins with one of ``[]{{}}*&!|>%@`'"``. A text below `|` needs none. Indent with blanks, never
  with tabs.
- `autograder quiz lint NAME` shows everything that is wrong with a bank, with line numbers.
- `autograder quiz schema --json > quiz.schema.json` writes a JSON Schema. An editor that knows YAML
  completes fields with it if the bank's first line is
  `# yaml-language-server: $schema=quiz.schema.json`.
"""
_PARTS = {"Concept": "Each concept", "Option": "Each option", "Trap": "Each trap",
          "Pair": "Each pair"}  # fmt: skip
_ROW = "| {} | {} | {} | {} | {} |"


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a bank's file."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Bank.model_json_schema()}


def as_markdown() -> str:
    """Return the page: each field of each part, and two examples."""
    schema = json_schema()
    parts = schema["$defs"]
    lines = [_HEAD, "## The bank", "", *_fields_table(schema), "", "## Each concept", ""]
    lines += [*_fields_table(parts["Concept"]), "", "## Each question", ""]
    common = _in_all([parts[model.__name__] for model in KINDS.values()])
    lines += ["Every question has these fields, and those of its kind.", ""]
    lines += _fields_table(parts["Single"], only=common)
    kinds = ", ".join(f"`{kind}`" for kind in KINDS)
    lines.append(_ROW.format("`kind`", "The kind of question.", f"one of {kinds}", "", "always"))
    for kind, model in KINDS.items():
        part = parts[model.__name__]
        own = [name for name in part["properties"] if name not in (*common, "kind")]
        lines += ["", f"### kind: {kind}", "", _clean_sentence(part["description"]), ""]
        lines += _fields_table(part, only=own)
    for name in ("Option", "Trap", "Pair"):
        part = parts[name]
        lines += ["", f"## {_PARTS[name]}", "", _clean_sentence(part["description"]), ""]
        lines += _fields_table(part)
    for title, name in (("A closed quiz", "exam"), ("A quiz that teaches", "lesson")):
        text = (EXAMPLES / f"{name}.yaml").read_text(encoding="utf-8")
        lines += ["", f"## {title}, whole", "", f"`{name}.yaml`:", "", "```yaml", text.rstrip()]
        lines += ["```"]
    return "\n".join(lines) + "\n"


def _in_all(parts: list[dict[str, Any]]) -> list[str]:
    """Return the fields that mean the same in all parts."""
    first, *others = (part["properties"] for part in parts)
    return [name for name in first if all(other.get(name) == first[name] for other in others)]


def _fields_table(part: dict[str, Any], only: list[str] | None = None) -> list[str]:
    names = [name for name in part["properties"] if only is None or name in only]
    lines = [_ROW.format("Field", "What", "Value", "If left out", "Required")]
    lines.append(_ROW.format("---", "---", "---", "---", "---"))
    for name in names:
        field = part["properties"][name]
        required = name in part.get("required", ())
        needed = "always" if required else "to teach" if field.get(TO_TEACH) else ""
        default = "" if required else _describe_default(field)
        what = _clean_sentence(field.get("description", ""))
        lines.append(_ROW.format(f"`{name}`", what, _describe_value(field), default, needed))
    return lines


def _clean_sentence(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("``", "`")


def _describe_default(field: dict[str, Any]) -> str:
    if "default" not in field:
        return "none"
    value = field["default"]
    if value is None or value == "":
        return "none"
    return f"`{str(value).lower()}`"


def _describe_value(field: dict[str, Any]) -> str:
    """Return what may stand in a field, with its bounds, in words."""
    if "anyOf" in field:
        return " or ".join(
            _describe_value(one) for one in field["anyOf"] if one.get("type") != "null"
        )
    if "const" in field:
        return f"`{field['const']}`"
    if "oneOf" in field:
        return "question"
    if "$ref" in field:
        return str(field["$ref"]).rpartition("/")[2].lower()
    kind = field["type"]
    if kind == "array":
        count = _describe_range(field.get("minItems"), field.get("maxItems"))
        return " ".join(
            ["list of", *([count] if count else []), f"{_describe_value(field['items'])}s"]
        )
    if kind == "object":
        return "ids, each with a text"
    if kind == "string":
        if "pattern" in field:
            return f"id, at most {field['maxLength']} characters"
        return "text" if field.get("minLength") else "text, may be empty"
    name = {"integer": "whole number", "number": "number", "boolean": "`true` or `false`"}[kind]
    bounds = _describe_range(field.get("minimum"), field.get("maximum"))
    return f"{name}, {bounds}" if bounds else name


def _describe_range(least: float | None, most: float | None) -> str:
    if least is not None and most is not None:
        return f"{least:g} to {most:g}"
    if least is not None:
        return f"at least {least:g}"
    return "" if most is None else f"at most {most:g}"
