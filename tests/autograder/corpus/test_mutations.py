"""Small mistakes of students: each is one change of one place, and compiles."""

from __future__ import annotations

import ast

import pytest

from autograder import exercises
from autograder.assignments.cells import without_markers
from autograder.corpus.mutations import find_mutations
from autograder.util import exercise_folders


def changes(text: str) -> set[tuple[str, str]]:
    return {(mutation.operator, mutation.after) for mutation in find_mutations(text)}


@pytest.mark.parametrize(
    ("line", "operator", "after"),
    [
        ("qos = QoSProfile(depth=5)", "depth of a queue", "qos = QoSProfile(depth=1)"),
        ("qos = QoSProfile(depth=5)", "depth of a queue", "qos = QoSProfile(depth=100)"),
        ("n.create_subscription(T, 't', f, 10)", "depth of a queue",
         "n.create_subscription(T, 't', f, 1)"),
        ("wheels = 4", "number", "wheels = 5"),
        ("x = Policy.RELIABLE", "other policy or end", "x = Policy.BEST_EFFORT"),
        ("self.timer.cancel()", "call left out", "pass"),
        ("await self.client.call_async(r)", "call left out", "pass"),
        ("answer.success = True", "true or false", "answer.success = False"),
        ("ok = 0.1 <= rate <= 10.0", "bound", "ok = 0.1 < rate <= 10.0"),
        ("ok = 0.1 <= rate <= 10.0", "bound", "ok = 0.1 <= rate < 10.0"),
        ("ok = 1.0 / rate", "number", "ok = 2.0 / rate"),
        ("g = ReentrantCallbackGroup()", "other callback group",
         "g = MutuallyExclusiveCallbackGroup()"),
        ("t = n.create_timer(1, f, callback_group=g)", "callback group dropped",
         "t = n.create_timer(1, f, callback_group=None)"),
        ("if done: x = f()", "condition", "if not (done): x = f()"),
        ("def f(a): return a", "reply not returned", "def f(a): return None"),
        ("goal.succeed()", "other policy or end", "goal.abort()"),
        ("def f(a):\n    x = a", "sleep in a callback",
         "__import__('time').sleep(2); x = a"),
        ("s = 'ä' + str(1)", "number", "s = 'ä' + str(2)"),
    ],
)  # fmt: skip
def test_a_mistake_of_the_field_is_made(line: str, operator: str, after: str) -> None:
    assert (operator, after) in changes(line)


@pytest.mark.parametrize("line", ["super().__init__('node')", "while True: x = y", "x: int"])
def test_what_would_be_no_mistake_of_a_student_is_left_alone(line: str) -> None:
    assert changes(line) <= {("true or false", "while False: x = y")}


def test_what_another_definition_replaces_is_left_alone() -> None:
    stub = "class Robot(Node):\n    wheels = 4\n"
    right = "class Robot(Node):\n    wheels = 3\n"
    assert [m.after for m in find_mutations(stub + right)] == ["wheels = 4"]
    used = find_mutations(stub + "first = Robot()\n" + right)
    assert [m.after for m in used if m.operator == "number"] == ["wheels = 5", "wheels = 4"]
    given = "def f(self):\n    answer = NO\n    answer = 1\n    return answer\n"
    assert not [m for m in find_mutations(given) if m.before == "answer = NO"]


def test_a_mutation_says_in_which_function_it_is() -> None:
    text = "def stop(self):\n    self.halt()\n\n\ndef end(self):\n    self.halt()\n"
    left_out = [m.key for m in find_mutations(text) if m.operator == "call left out"]
    assert left_out == [
        "call left out in stop: self.halt() -> pass",
        "call left out in end: self.halt() -> pass",
    ]


def test_the_depth_of_a_publisher_is_free() -> None:
    assert not changes("p = n.create_publisher(T, 't', 10)")


def test_a_mutation_is_known_by_what_it_changes_and_not_by_its_line() -> None:
    (first,) = find_mutations("x = 1")
    (second,) = find_mutations("\n\nx = 1")
    assert (first.line, second.line) == (1, 3)
    assert first.key == second.key == "number in x: x = 1 -> x = 2"


@pytest.mark.parametrize("exam", sorted(exercises.exercise_names()))
def test_of_every_exemplar_there_are_some_and_all_compile(exam: str) -> None:
    task = exercise_folders.exercise_file(exam, exercise_folders.TASK).read_text()
    cell = task[task.index(f'"grade_id": "{exam}-solution"') :].partition("\n")[2]
    text = without_markers(cell.partition("\n# %%")[0])
    found = find_mutations(text)
    assert len(found) > 10
    for mutation in found:
        ast.parse(mutation.text)
        assert mutation.text != text
