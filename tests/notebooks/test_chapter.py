"""Chapter 5: what it says, and in which doses."""

from __future__ import annotations

import ast
import re

import nbformat
import pytest

from course.workspace.journal.time_needed import find_minutes

from .chapter_five import is_try, read_chapter, tags

MOST_WORDS = 250
"""Words that may stand between two code cells; and as many again that are folded."""

SECTIONS = [
    "Chapter 5: Nodes, Topics, Services - The Building Blocks of ROS 2",
    "Introduction",
    "Learning objectives",
    "Hook",
    "Before you learn this",
    "Common misunderstanding",
    "Concept",
    "Nodes: the processing units",
    "Topics: continuous data sharing (publish-subscribe)",
    "Services: synchronous request-response",
    "Actions: long-running operations with feedback",
    "When to use what",
    "Quality of Service (QoS) profiles",
    "Real-world examples and analogies",
    "Diagram",
    "Code",
    "SensorNode: topics with different QoS",
    "ProcessingNode: subscribers that match",
    "ServiceNode: answers on request",
    "ActionNode: a long operation, with feedback",
    "ClientNode: the one who asks",
    "main: all five at once",
    "Exercises",
    "Exercise solutions",
    "Summary",
    "Part 2 Quiz",
    "Preview: the next chapter",
]
IDEAS = [
    "Introduction", "Nodes: the processing units",
    "Topics: continuous data sharing (publish-subscribe)", "Quality of Service (QoS) profiles",
    "Services: synchronous request-response", "Actions: long-running operations with feedback",
    "When to use what",
]  # fmt: skip
"""Sections each of which is followed by something that the learner changes."""

NODE_CLASSES = ["SensorNode", "ProcessingNode", "ServiceNode", "ActionNode", "ClientNode"]
NOTES = {
    "blocking is the client's choice": "Waiting is the *client's* choice",
    "KEEP_ALL ignores the depth": "With `KEEP_ALL` the depth is ignored",
    "parameters are services": "read and written through services",
    "waiting in a callback": "holds a thread of the executor",
    "cancel and the executor": "a cancellation comes too late",
    "Ctrl-C": "that call raises an error",
    "order 5 is six numbers": "A goal of order 5 yields **six** numbers",
    "cancel_callback": "declines every one of them",
    "lifecycle": "A *managed* node (`LifecycleNode`)",
    "error codes": "`rclpy` sends no response at all",
    "states": "A goal that the server *rejects* never gets a status",
    "RELIABLE": "while the publisher still has it in its history",
}
FACTS = [
    # The text of the chapter, section by section; what stands here is how it is said now.
    "the nervous system of a Physical AI system", "neurons, synapses and pathways",
    "**explain** how a ROS 2 node is built, how it lives and ends",
    "**describe** publish-subscribe", "**implement** nodes", "**analyse** what each",
    "**evaluate** which pattern",
    "Follow one camera image", "publishes the detections on a second topic",
    "calls a service of the localization system",
    "a goal is sent to the navigation system's action",
    "the basic processing unit of ROS 2", "**Myth:** topics are the most common pattern",
    "**Reality:** topics, services and actions each suit different cases",
    "**Single responsibility.**", "**Lifecycle management.**", "**Resource management.**",
    "initialization | creates its publishers, subscribers, services and actions",
    "cleanup | releases its resources properly", "timers, callbacks and communication endpoints",
    "a memory leak", "a sensory neuron", "**Publishers and subscribers.**",
    "Several publishers on one topic are allowed, but uncommon", "**Asynchronous communication.**",
    "*loose coupling*", "**Message types.**", "type-safe and predictable",
    "a direct neural pathway", "**Client-server model.**", "the call blocks",
    "**Synchronous processing.**", "**Error handling.**", "an error code and a message",
    "a complex motor pattern", "**Goal, feedback, result.**", "**Non-blocking.**",
    "**Cancellation.**", "**Goal status.**", "pending, executing, succeeded or failed",
    "many readers want the same data", "asynchronous communication is acceptable",
    "under a few seconds", "one to one", "the operation takes a long time",
    "it may have to be canceled", "a clear start and a clear end",
    "Must messages be delivered (`RELIABLE`), or is some loss acceptable (`BEST_EFFORT`)",
    "Safety-critical data should use `RELIABLE`", "Does a late joiner get messages",
    "everything (`KEEP_ALL`), or the latest few messages (`KEEP_LAST` with a *depth*)",
    "parameter information for instance", "a small depth keep the memory bounded",
    "broadcast vital signs", "one particular lab result", "Surgery is long and complex",
    "temperature and humidity", "the light to be turned on", "Security monitoring",
    "`BEST_EFFORT` | `VOLATILE` | `KEEP_LAST`, depth 5", "`RELIABLE` | `VOLATILE` | `KEEP_ALL`",
    "`RELIABLE` | `VOLATILE` | `KEEP_LAST`, depth 10", "from a single robot to a team of them",
    "real hardware", "production-ready robotic applications",
]  # fmt: skip


@pytest.fixture(scope="module")
def chapter() -> nbformat.NotebookNode:
    return read_chapter()


@pytest.fixture(scope="module")
def prose(chapter: nbformat.NotebookNode) -> str:
    return "\n\n".join(cell.source for cell in chapter.cells if cell.cell_type == "markdown")


def headings(text: str) -> list[str]:
    return re.findall(r"^#{1,4} (.+)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.M)


def folded_parts(text: str) -> list[str]:
    return re.findall(r"<details>.*?</details>", text, re.DOTALL)


def count_words(text: str) -> int:
    """Count what a reader reads: no marks of Markdown, no code, and no drawing as text."""
    text = re.sub(r"```.*?```|</?\w+>|\]\(.*?\)", " ", text, flags=re.DOTALL)
    return sum(any(letter.isalnum() for letter in word) for word in text.split())


def stretches(chapter: nbformat.NotebookNode) -> list[str]:
    """Return what stands between two code cells, without the solutions: students have none."""
    found = [""]
    for cell in chapter.cells:
        if cell.cell_type == "code":
            found.append("")
        elif "solutions" not in tags(cell):
            found[-1] += "\n\n" + cell.source
    return found


def test_every_section_is_there_once(prose: str) -> None:
    for section in SECTIONS:
        assert headings(prose).count(section) == 1, section


def test_every_fact_of_the_text_is_there(prose: str) -> None:
    said = re.sub(r"\s+", " ", prose)
    assert [fact for fact in FACTS if fact not in said] == []


def test_no_more_than_250_words_stand_between_two_code_cells(
    chapter: nbformat.NotebookNode,
) -> None:
    for text in stretches(chapter):
        folded = "\n".join(folded_parts(text))
        shown = re.sub(r"<details>.*?</details>", "", text, flags=re.DOTALL)
        assert count_words(shown) <= MOST_WORDS, text
        assert count_words(folded) <= MOST_WORDS, text


def test_a_robot_and_a_node_come_before_the_first_idea(chapter: nbformat.NotebookNode) -> None:
    first = next(cell for cell in chapter.cells if cell.cell_type == "code")
    assert first.source.splitlines()[:2] == ["%load_ext course", "import course"]
    assert first.source.splitlines()[-1] == 'course.world("warehouse")'
    assert 'watcher.create_subscription(LaserScan, "scan"' in first.source
    assert len(first.source.splitlines()) <= 12  # so that the robot is on the first screen
    assert count_words(stretches(chapter)[0]) < 80


def test_each_idea_is_followed_by_something_to_change(chapter: nbformat.NotebookNode) -> None:
    for idea in IDEAS:
        [place] = [
            place
            for place, cell in enumerate(chapter.cells)
            if cell.cell_type == "markdown" and idea in headings(cell.source)
        ]
        following = [cell for cell in chapter.cells[place + 1 :] if cell.cell_type == "code"][:2]
        assert any(is_try(cell) for cell in following), idea


def test_what_is_to_be_changed_is_marked_and_checked_in_the_same_cell(
    chapter: nbformat.NotebookNode,
) -> None:
    tries = [cell.source for cell in chapter.cells if is_try(cell)]
    assert len(tries) >= 15
    for source in tries:
        assert "YOURS" in source
        last = source.splitlines()[-1]
        assert last.startswith("check.") or (last == "found" and "found = check." in source)
    assert sum("YOURS" in cell.source for cell in chapter.cells) == len(tries)


def test_a_reader_meets_no_assert(chapter: nbformat.NotebookNode) -> None:
    for cell in chapter.cells:
        assert "assert " not in cell.source


def test_it_says_at_the_top_and_after_each_part_how_long_things_take(prose: str) -> None:
    parts = [int(minutes) for minutes in re.findall(r"^## \d\. .*\((\d+) minutes\)$", prose, re.M)]
    assert len(parts) == 7
    assert sum(parts) == find_minutes(prose.partition("## 1.")[0])
    assert f"part 1 takes {parts[0]} minutes" in prose
    for number, minutes in enumerate(parts[1:], start=1):
        announced = prose.partition(f"*That was part {number}.")[2].partition("*")[0]
        assert f"takes {minutes} minutes" in announced


def test_it_refers_to_nothing_that_the_reader_does_not_have(prose: str) -> None:
    assert not re.search(r"print(ed)? (chapter|book|edition)", prose)
    assert set(re.findall(r"[Cc]hapter (\d+)", prose)) <= {"5", "6"}


@pytest.mark.parametrize("sentence", NOTES.values(), ids=NOTES.keys())
def test_each_correction_is_a_folded_note_with_a_source(prose: str, sentence: str) -> None:
    notes = [re.sub(r"\s+", " ", note) for note in folded_parts(prose)]
    [note] = [note for note in notes if sentence in note]
    assert "<summary>More" in note
    if sentence != NOTES["order 5 is six numbers"]:  # arithmetic needs no authority
        assert re.search(r"Sources?: ", note)


def test_sources_are_named_in_folded_text_only(prose: str) -> None:
    shown = re.sub(r"<details>.*?</details>", "", prose, flags=re.DOTALL)
    assert not re.search(r"Sources?: ", shown)


def test_solutions_stand_in_tagged_cells_and_nowhere_else(chapter: nbformat.NotebookNode) -> None:
    [solutions] = [cell for cell in chapter.cells if "solutions" in tags(cell)]
    assert headings(solutions.source) == ["Exercise solutions"]
    rest = "\n".join(cell.source for cell in chapter.cells if cell is not solutions)
    for fact in ("Path planner | map and goal", "| IMU |", "battery's topic transient-local"):
        assert fact in solutions.source
        assert fact not in rest
    [folded] = folded_parts(solutions.source)
    assert re.findall(r"^\*\*(\d)\. ", folded, re.MULTILINE) == list("12345")


def test_the_exercises_are_five_and_link_to_their_notebooks(prose: str) -> None:
    exercises = prose.partition("## Exercises")[2].partition("## Exercise solutions")[0]
    assert re.findall(r"^\*\*(\d)\. ", exercises, re.MULTILINE) == list("12345")
    links = re.findall(r"\]\((.+?)\)", exercises)
    names = ("qos-design", "architecture", "patterns", "resources", "error-handling")
    assert links == [f"ch05/{name}.ipynb" for name in names]


def test_the_quiz_has_five_questions_and_no_key(prose: str) -> None:
    quiz = prose.partition("## Part 2 Quiz")[2].partition("## Preview")[0]
    assert "**4 of 5**" in quiz
    assert "3.5" in quiz
    assert "(ch05-quiz/quiz.ipynb)" in quiz
    assert re.findall(r"^(\d)\. .*\?$", quiz, re.MULTILINE) == list("12345")
    assert not re.search(r"correct|solution|key", quiz, re.IGNORECASE)


def test_the_diagram_is_mermaid_with_three_patterns(prose: str) -> None:
    [diagram] = re.findall(r"```mermaid\n(.*?)```", prose, re.DOTALL)
    for box in ("Camera Driver", "Image Processing", "Object Detection", "Navigation Client"):
        assert box in diagram
    for box in ("Path Planner", "Motion Client", "Navigation Server", "QoS"):
        assert box in diagram


def test_each_node_is_run_by_the_code_cell_that_follows_it(chapter: nbformat.NotebookNode) -> None:
    code = [cell.source for cell in chapter.cells if cell.cell_type == "code"]
    for name in NODE_CLASSES:
        [place] = [i for i, source in enumerate(code) if f"class {name}(Node):" in source]
        assert f"run({name})" in code[place + 1]


def test_the_program_is_the_five_nodes_and_main(chapter: nbformat.NotebookNode) -> None:
    rest = [
        cell.source
        for cell in chapter.cells
        if cell.cell_type == "code" and "notebook-only" not in tags(cell)
    ]
    tree = ast.parse("\n".join(rest))
    classes = [node.name for node in tree.body if isinstance(node, ast.ClassDef)]
    functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert (classes, functions) == (NODE_CLASSES, ["main"])


def test_the_finale_drives_a_robot_beside_the_graph_of_the_five_nodes(
    chapter: nbformat.NotebookNode,
) -> None:
    code = [cell.source for cell in chapter.cells if cell.cell_type == "code"]
    [place] = [i for i, source in enumerate(code) if "class DrivingActionNode" in source]
    assert "[hall.widget, system.graph().widget]" in code[place - 1]
    for name in [name for name in NODE_CLASSES if name != "ActionNode"]:
        assert name in code[place]


def test_no_cell_sleeps(chapter: nbformat.NotebookNode) -> None:
    for cell in chapter.cells:
        if cell.cell_type == "code":
            lines = [line for line in cell.source.splitlines() if not line.startswith("%")]
            tree = ast.parse("\n".join(lines))
            calls = {ast.unparse(n.func) for n in ast.walk(tree) if isinstance(n, ast.Call)}
            assert not calls & {"time.sleep", "sleep", "rclpy.spin", "input"}
