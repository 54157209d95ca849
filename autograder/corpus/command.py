"""What ``autograder corpus`` does: run the corpus of one exam or of all."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence

from autograder import exercises, sandbox
from autograder.corpus import corpus_files, trials
from autograder.corpus.case import Case, CorpusError
from autograder.corpus.trials import CorpusTrial
from autograder.examination.draws import USUAL_SEED


def load_cases(exam: str = "") -> dict[str, list[Case]]:
    """Return the cases of one exam or (empty) of all, by exam.

    Raises:
        ExamError: there is no such exam; names the ones there are.
        CorpusError: a corpus is missing or not well formed.
    """
    chosen = [exercises.load_exam(exam).name] if exam else exercises.exercise_names()
    return {name: corpus_files.load_cases(name) for name in chosen}


def run_corpus(
    exam: str = "",
    *,
    only: Sequence[str] = (),
    repeat: int = 1,
    jobs: int = 2,
    load: int = 0,
    seed: int = USUAL_SEED,
    say: Callable[[str], None] = lambda _line: None,
) -> list[CorpusTrial]:
    """Run the corpus of ``exam`` (of all exams if it is empty).

    Args:
        exam: the exam's name.
        only: names of cases, if not all.
        repeat: how often each case is run.
        jobs: how many run at a time.
        load: how many busy loops run beside them.
        seed: what the numbers of an exam are drawn from; what cases say is worded for the usual.
        say: is told a line a run.

    Raises:
        ExamError: an unknown exam.
        CorpusError: no case of that name; or a corpus that is not well formed.
    """
    chosen = choose_cases(load_cases(exam), only)
    trust = needs_trust(say)
    done = []
    with trials.busy_loops(load):
        for name, own in chosen.items():
            source, released = trials.make_notebooks(name)
            done += trials.run(
                own, source, released, jobs=jobs, repeat=repeat, trust=trust, seed=seed,
                done=lambda trial: say(_describe_trial(trial)),
            )  # fmt: skip
    return done


def choose_cases(every: dict[str, list[Case]], only: Sequence[str]) -> dict[str, list[Case]]:
    """Return the cases with the names in ``only``; all, if there are none."""
    names = sorted({case.name for own in every.values() for case in own})
    for name in only:
        if name not in names:
            corpus = f"corpus of '{next(iter(every))}'" if len(every) == 1 else "corpus"
            close = ", ".join(difflib.get_close_matches(name, names, n=3, cutoff=0.5))
            guess = f"did you mean {close}?" if close else "`--table` shows the ones there are."
            raise CorpusError(f"The {corpus} has no case '{name}': {guess}")
    chosen = {
        exam: [case for case in own if not only or case.name in only] for exam, own in every.items()
    }
    return {exam: own for exam, own in chosen.items() if own}


def needs_trust(say: Callable[[str], None]) -> bool:
    """Return whether our own bundled submissions must do without a sandbox; say so if they must."""
    if problem := sandbox.abilities().problem:
        say(f"Going on without a sandbox, as these submissions are the course's own. {problem}")
    return bool(problem)


def _describe_trial(trial: CorpusTrial) -> str:
    case = trial.case
    return (
        f"  {case.exam}/{case.name}: {trial.difference or 'as expected'} "
        f"({trial.outcome.seconds:.1f} s)"
    )
