"""The graders are graded: every case of the corpus gets exactly its verdict, on real DDS."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import psutil
import pytest

from autograder import corpus, exercises
from autograder.assignments import submission
from autograder.assignments.cells import without_markers
from autograder.corpus import Case, CorpusError, CorpusTrial, command, tables, trials
from autograder.corpus.trials import Notebooks
from autograder.examination import points
from autograder.running import runner
from autograder.sandbox import abilities
from autograder.sandbox.sandbox_support import Abilities

CASES = {exam: corpus.load_cases(exam) for exam in exercises.exercise_names()}
EXAMS = pytest.mark.parametrize("exam", exercises.exercise_names())


@cache
def notebooks(exam: str) -> Notebooks:
    return trials.make_notebooks(exam)


WHOLE = "qos"
"""The exam whose corpus is always run whole."""

SAMPLE = (
    "right-exemplar", "right-chapter", "wrong-stub", "wrong-emptied", "broken-syntax",
    "broken-says-passed",
)  # fmt: skip
"""What is run of the other corpora: together they are 500 runs of some seconds each, for which
`autograder corpus` is there. With AUTOGRADER_WHOLE_CORPUS=1 they are run whole here, too."""


def chosen(exam: str) -> list[Case]:
    if exam == WHOLE or os.environ.get("AUTOGRADER_WHOLE_CORPUS"):
        return CASES[exam]
    return [case for case in CASES[exam] if case.name in SAMPLE]


def run(cases: list[Case], jobs: int = 1) -> list[CorpusTrial]:
    """Run cases of one exam: in the sandbox, or where there is none with this user's rights."""
    trust = bool(abilities().problem)
    return corpus.run(cases, *notebooks(cases[0].exam), jobs=jobs, trust=trust)


@cache
def results(exam: str) -> dict[str, CorpusTrial]:
    """Run a whole corpus, two cases at a time (they mostly wait); return its trials by name."""
    done = run(chosen(exam), jobs=2)
    return {trial.case.name: trial for trial in done}


@pytest.mark.timeout(1800)  # the first case of an exam runs them all
@pytest.mark.parametrize(
    "case",
    [
        pytest.param(
            case,
            id=f"{case.exam}-{case.name}",
            marks=pytest.mark.xdist_group(f"corpus-{case.exam}"),
        )
        for exam in CASES
        for case in chosen(exam)
    ],
)
def test_the_case_gets_its_verdict(case: Case) -> None:
    trial = results(case.exam)[case.name]
    assert trial.difference == "", trial.outcome.verdicts


@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    "exam", [pytest.param(exam, marks=pytest.mark.xdist_group(f"corpus-{exam}")) for exam in CASES]
)
def test_no_check_that_the_untouched_notebook_passes_earns_a_point(exam: str) -> None:
    verdicts = results(exam)["wrong-stub"].outcome.verdicts.values()
    passed = {c.name: c.max_points for verdict in verdicts for c in verdict.checks if c.passed}
    assert {name for name, points in passed.items() if points} == set()
    assert sum(verdict.score for verdict in verdicts) == 0
    parts = points.table()[exam].parts.values()
    assert sum(verdict.max_score for verdict in verdicts) == sum(sum(p.values()) for p in parts)


@EXAMS
def test_the_stub_and_what_is_no_more_than_the_stub_are_held_at_no_points(exam: str) -> None:
    cases = {case.name: case for case in CASES[exam]}
    stub = cases["wrong-stub"]
    assert stub.points == 0
    assert set(stub.stub.values()) == {"\n"}, "it is the notebook as it was handed out"
    printed = cases["wrong-stub-with-a-print"]
    assert (printed.fails, printed.says, printed.points) == (stub.fails, stub.says, stub.points)
    assert "print(" in printed.stub[f"{exam}-solution"]
    assert not printed.blank
    assert cases["wrong-emptied"].points == 0


@EXAMS
def test_a_check_that_no_mutant_needs_is_not_a_check(exam: str) -> None:
    assert tables.without_mutant(exam, CASES[exam]) == []


@EXAMS
def test_every_mutant_is_killed_and_designs_differ(exam: str) -> None:
    own = CASES[exam]
    for case in own:
        assert (not case.fails) == case.name.startswith("right-"), case.name
        assert case.must_fail <= set(exercises.load_exam(exam).checks), case.name
    assert sum(not case.fails for case in own) >= 6
    assert sum(bool(case.fails) for case in own) >= 15


@EXAMS
def test_every_mistake_is_told_in_words_that_are_tested(exam: str) -> None:
    mistakes = [case for case in CASES[exam] if case.name.startswith("wrong-")]
    assert [case.name for case in mistakes if not case.says] == []


def test_the_table_of_checks_and_mutants_is_in_step() -> None:
    table = Path(tables.__file__).with_name("README.md")
    assert table.read_text(encoding="utf-8") == tables.checks_matrix(CASES)


def test_a_difference_is_reported() -> None:
    right = next(case for case in CASES["qos"] if case.name == "right-chapter")
    claimed = Case("qos", "claimed", "t", frozenset({"imu_burst"}), stub=right.stub)
    (trial,) = run([claimed])
    assert trial.difference == "did not fail but must: imu_burst"


def test_other_points_than_a_case_must_earn_are_reported() -> None:
    case = CASES["qos"][0]
    program = submission.extract_program(case.make_submission(*notebooks("qos")))
    outcome = runner.refused_outcome(program, "this machine was too busy", "not_examined")
    assert "earned 0 points, not 3" in replace(case, points=3.0).verdict_of(outcome)
    assert "earned" not in replace(case, points=0.0).verdict_of(outcome)


def test_a_message_without_its_fragment_is_reported() -> None:
    wrong = next(case for case in CASES["qos"] if case.name == "wrong-imu-single")
    says = {"imu_burst": "the moon"}
    case = Case("qos", "claimed", "t", wrong.fails, says=says, stub=wrong.stub)
    (trial,) = run([case])
    assert trial.difference.startswith("imu_burst does not say 'the moon': ")


def test_what_the_grader_failed_at_is_reported_with_the_reason() -> None:
    case = CASES["qos"][0]
    program = submission.extract_program(case.make_submission(*notebooks("qos")))
    outcome = runner.refused_outcome(program, "the examiner was ended", "grader_error")
    difference = case.verdict_of(outcome)
    assert "grader error in " in difference
    assert "the examiner was ended" in difference


def test_what_could_not_be_examined_is_reported_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    case = CASES["qos"][0]
    program = submission.extract_program(case.make_submission(*notebooks("qos")))
    outcome = runner.refused_outcome(program, "this machine was too busy", "not_examined")
    told = "imu_burst was not examined: 'this machine was too busy'"
    monkeypatch.setattr("autograder.corpus.case.abilities", lambda: Abilities(loss=True))
    assert told in case.verdict_of(outcome)
    # Without a sandbox the loss of packets is never examined, and that is no difference.
    monkeypatch.setattr("autograder.corpus.case.abilities", lambda: Abilities())
    assert told not in case.verdict_of(outcome)


def test_feedback_that_shows_the_insides_of_the_grader_is_reported() -> None:
    case = CASES["qos"][0]
    program = submission.extract_program(case.make_submission(*notebooks("qos")))
    outcome = runner.refused_outcome(program, "see /tmp/x/exam.py", "not_examined")
    assert "feedback holds '/tmp/'" in case.verdict_of(outcome)


def test_a_flip_between_repeats_is_found() -> None:
    case = CASES["qos"][0]
    (first,) = run([case])
    second = trials.CorpusTrial(case, first.outcome, "")
    assert tables.all_flips([first, second]) == []
    second.outcome.verdicts.clear()
    third = trials.CorpusTrial(case, run([case])[0].outcome, "")
    assert tables.all_flips([second, third]) != []


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("case.py", "x = 1\n", r"case\.py must begin with"),
        ("case.py", "# title: t\n# fails: x\n# in: the exemplar\n", "'# in:' can be 'the stub'"),
        ("case.py", "# title: t\n# fails: as the stub\n", r"corpus of 'qos' has no wrong-stub\.py"),
        ("case.py", "# title: t\n# fails: x\n# points: no\n", "'# points:' is a number, not 'no'"),
        ("mutants.toml", "[broken\n", r"mutants\.toml is not TOML"),
        ("mutants.toml", "[mutant]\ntitle = 'x'\n", r"'mutant' needs .*: 'fails' is missing"),
    ],
)
def test_a_corpus_that_is_not_well_formed_is_named(
    tmp_path: Path, name: str, text: str, message: str
) -> None:
    (tmp_path / "right.py").write_text("# title: t\n# fails: nothing\nx = 1\n")
    (tmp_path / name).write_text(text)
    with pytest.raises(CorpusError, match=message):
        corpus.load_cases("qos", tmp_path)


def test_a_case_without_splices_is_the_exemplar(tmp_path: Path) -> None:
    # A table of mutants is a corpus, too: there is no other file.
    table = "[right-exemplar]\ntitle = 'The exemplar'\nfails = []\nsplices = []\n"
    (tmp_path / "mutants.toml").write_text(table)
    case = next(
        c
        for c in corpus.load_cases("qos", tmp_path, every=tmp_path / "none")
        if c.name == "right-exemplar"
    )
    source, released = notebooks("qos")
    handed_in = case.make_submission(source, released)
    solution = next(c for c in handed_in.cells if submission.grade_id(c) == "qos-solution")
    exemplar = next(c for c in source.cells if submission.grade_id(c) == "qos-solution")
    assert solution.source == without_markers(exemplar.source)


def test_busy_loops_end_with_the_block_and_with_a_process_that_is_killed() -> None:
    with trials.busy_loops(1):
        (loop,) = (p for p in psutil.Process().children() if "getppid" in " ".join(p.cmdline()))
    assert not loop.is_running()
    inside = "with busy_loops(2): print('running', flush=True); sys.stdin.read()"
    program = f"import sys\nfrom autograder.corpus.trials import busy_loops\n{inside}"
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as load:
        assert load.stdout is not None
        assert load.stdout.readline() == "running\n"
        loops = psutil.Process(load.pid).children()
        load.kill()
    assert len(loops) == 2
    _, left = psutil.wait_procs(loops, timeout=30.0)
    assert left == []


def test_a_missing_corpus_is_named(tmp_path: Path) -> None:
    with pytest.raises(CorpusError, match="no corpus for 'other'"):
        corpus.load_cases("other", tmp_path)


def test_a_case_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trials, "run", lambda *_, **__: pytest.fail("nothing should be run"))
    with pytest.raises(CorpusError, match="no case 'right-halt': did you mean right-halts"):
        command.run_corpus(only=["right-exemplar", "right-halt"])


def test_a_splice_that_does_not_fit_the_exemplar_is_refused() -> None:
    source, released = notebooks("qos")
    splices = {"qos-solution": (("not there", "new"),)}
    case = Case("qos", "mutant", "t", frozenset({"imu_burst"}), splices=splices)
    with pytest.raises(CorpusError, match="'not there' stands 0 times in the exemplar"):
        case.make_submission(source, released)


@pytest.mark.parametrize(
    ("case", "said"),
    [
        (
            Case("qos", "wrong-x", "t", frozenset({"imu_brst"})),
            r"qos/wrong-x: it names a check 'imu_brst', which its exam does not have "
            r"\(is it 'imu_burst'\?\)",
        ),
        (
            Case("qos", "right-x", "t", frozenset(), cells={"qos-other": "x = 1"}),
            "qos/right-x: there is no cell 'qos-other' in the notebook",
        ),
    ],
)
def test_no_case_is_run_if_one_does_not_fit_its_exercise(
    case: Case, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "run", lambda *_, **__: pytest.fail("nothing should be run"))
    good = Case("qos", "right-exemplar", "t", frozenset(), splices={"qos-solution": ()})
    with pytest.raises(CorpusError, match=said):
        trials.run([good, case], *notebooks("qos"))
