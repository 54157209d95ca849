"""What a student of exercise 5 reads, word for word: three mistakes, with all hints."""

from __future__ import annotations

import pytest

from autograder import corpus
from autograder.corpus import Case, trials
from autograder.examination.verdict_text import Report
from tests.autograder.goldens import golden, with_titles_of_pictures
from tests.machine import needs_isolation

CASES = {case.name: case for case in corpus.load_cases("safety")}
MISTAKES = ("wrong-gripper-constant-pauses", "wrong-speed-nan", "wrong-drive-shutdown-drives-on")


@needs_isolation
@pytest.mark.parametrize("name", MISTAKES)
def test_the_report_reads_as_it_should(name: str) -> None:
    (trial,) = corpus.run([CASES[name]], *trials.make_notebooks("safety"), jobs=1)
    shown = [repr(Report(verdict, hints=3)) for verdict in trial.outcome.verdicts.values()]
    text = "\n".join(shown) + "\n"
    text = with_titles_of_pictures(text)
    assert text == golden(f"safety-{name}", text)


# rclpy raises it: the subject tells of no mistake of its own, but a plain program ends.
CLIENT_RAISES = (
    "            self.cmd_vel.publish(Twist())\n        self.outcome.publish(String(data=word))",
    "            self.cmd_vel.publish(Twist())\n        self.outcome.publish(String(data=word))\n"
    "        self.outcome.publish('again')",
)
SERVER_DRIVES_ON = ("if goal_handle.is_cancel_requested:", "if goal_handle is None:")


@needs_isolation
def test_an_error_of_one_node_is_not_told_of_another() -> None:
    splices = {"safety-goals": (CLIENT_RAISES,), "safety-drive": (SERVER_DRIVES_ON,)}
    case = Case(
        "safety", "two", "Two mistakes", frozenset({"goals_end", "drive_cancels"}), splices=splices
    )
    (trial,) = corpus.run([case], *trials.make_notebooks("safety"), jobs=1)
    found = {check.name: check for v in trial.outcome.verdicts.values() for check in v.checks}
    assert {name for name, check in found.items() if check.status == "failed"} == case.fails
    assert "raised" not in found["drive_cancels"].actual
