"""The format of a bank is documented: page and model are in step, and the examples are sound."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from quizzes.bank import lint, loader, schema
from quizzes.bank.contents import COUNTED, MIN_VARIANTS, Bank, Concept, Option, Pair, Trap
from quizzes.bank.faults import KINDS

PAGE = Path(__file__).parents[3] / "notebooks" / "authoring" / "quizzes.md"
EXAMPLES = sorted(schema.EXAMPLES.glob("*.yaml"))


def test_the_page_is_what_the_command_prints() -> None:
    assert PAGE.read_text(encoding="utf-8") == schema.as_markdown(), (
        "run `autograder quiz schema > notebooks/authoring/quizzes.md`"
    )


def test_each_field_of_each_part_is_on_the_page_with_what_it_means() -> None:
    page = schema.as_markdown()
    for model in (Bank, Concept, Option, Trap, Pair, *KINDS.values()):
        for name, field in model.model_fields.items():
            assert field.description, f"{model.__name__}.{name} has no docstring"
            if name != "kind":
                said = " ".join(field.description.split())
                assert f"| `{name}` | {said} | " in page, f"{model.__name__}.{name}"
    assert f"At least {MIN_VARIANTS} in a" in page
    assert f"if left out, {COUNTED}, or 1 of a closed" in page


@pytest.mark.parametrize(
    "row",
    [
        "whole number, 1 to 100 | none |  |",
        "list of 2 to 10 options |  | always |",
        "number, at least 0 | `0.0` |  |",
        "text or list of at least 1 texts | none | to teach |",
        "one of `single`, `predict`, `multiple`, `numeric`, `ordering`, `matching` |  | always |",
        "`true` or `false` | `false` |  |",
        "id, at most 60 characters | none | to teach |",
    ],
)
def test_bounds_defaults_and_who_needs_a_field_are_on_the_page(row: str) -> None:
    assert row in schema.as_markdown()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_sound_and_clean(path: Path) -> None:
    bank = loader.read_bank(path)
    assert lint.list_findings(bank) == []
    assert f"`{path.name}`:\n\n```yaml\n{path.read_text().rstrip()}\n```" in schema.as_markdown()
    for answer in lint.wrong_answers(bank):
        if answer.show:
            exec(compile(answer.show, answer.where, "exec"), {})


def test_there_is_an_example_of_each_sort() -> None:
    assert sorted(loader.read_bank(path).closed for path in EXAMPLES) == [False, True]


def test_the_proofs_of_the_example_exist() -> None:
    proofs = Path(__file__).parents[1] / "proofs"
    for name in re.findall(r"(test_\w+\.py)::(\w+)", schema.as_markdown()):
        assert f"def {name[1]}(" in (proofs / name[0]).read_text()


@pytest.mark.parametrize("path", [*EXAMPLES, loader.BANKS / "ch05.yaml"], ids=lambda p: p.stem)
def test_editors_accept_what_the_course_accepts(path: Path) -> None:
    validator = Draft202012Validator(schema.json_schema())
    validator.check_schema(schema.json_schema())
    data: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert list(validator.iter_errors(data)) == []
    data["concepts"][0]["variants"][0]["stam"] = data["concepts"][0]["variants"][0].pop("stem")
    assert list(validator.iter_errors(data))
