"""What ``autograder mutate`` does: make small mistakes in an exemplar, and run its exam on each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from nbformat import NotebookNode

from autograder import exercises
from autograder.assignments import submission
from autograder.assignments.cells import without_markers
from autograder.corpus import trials
from autograder.corpus.case import Case, CorpusError, make_exemplar
from autograder.corpus.command import needs_trust
from autograder.corpus.corpus_files import equivalent_mutations
from autograder.corpus.mutations import Mutation, find_mutations

_CAUGHT = ("failed", "not_checked")
"""What a check says of a mutation that is noticed; where the grader failed, nothing was."""


@dataclass(frozen=True)
class Mutated:
    """What became of the mutations of an exercise.

    Attributes:
        caught: {mutation: the checks that failed}.
        survivors: those that passed every check.
        equivalent: {mutation: why it changes nothing}, as the corpus says; they were not run.
        stale: what the corpus says of mutations that there are not.
    """

    caught: dict[Mutation, list[str]] = field(default_factory=dict)
    survivors: list[Mutation] = field(default_factory=list)
    equivalent: dict[Mutation, str] = field(default_factory=dict)
    stale: list[str] = field(default_factory=list)


def mutate(exam: str, *, jobs: int = 2, say: Callable[[str], None] = lambda _line: None) -> Mutated:
    """Run the exam of an exercise on every mutation of its exemplar.

    Args:
        exam: the exercise.
        jobs: how many run at a time.
        say: is told a line a mutation.

    Raises:
        ExamError: an unknown exercise.
        CorpusError: its list of equivalent mutations is not well formed, or the exemplar itself
            does not pass, so that mutations of it show nothing, or the exam fails on one.
    """
    source, released = trials.make_notebooks(exercises.load_exam(exam).name)
    trust = needs_trust(say)
    [exemplar] = trials.run([make_exemplar(exam)], source, released, trust=trust)
    if exemplar.difference:
        raise CorpusError(
            f"The exemplar of {exam} does not pass its exam ({exemplar.difference}): see "
            f"`autograder try {exam}`, and mend the one or the other first."
        )
    reasons = equivalent_mutations(exam)
    found = [
        (grade_id, solution, mutation)
        for grade_id, solution in _solutions(source)
        for mutation in find_mutations(solution)
    ]
    keys = {mutation.key for _, _, mutation in found}
    result = Mutated(stale=sorted(reasons.keys() - keys))
    result.equivalent.update({m: reasons[m.key] for _, _, m in found if m.key in reasons})
    of_case: dict[str, Mutation] = {}
    cases: list[Case] = []
    for number, (grade_id, solution, mutation) in enumerate(found):
        if mutation not in result.equivalent:
            name = f"mutation-{number}"
            of_case[name] = mutation
            splices = {grade_id: ((solution, mutation.text),)}
            cases.append(Case(exam, name, str(mutation), frozenset(), splices=splices))

    def note(trial: trials.CorpusTrial) -> None:
        mutation = of_case[trial.case.name]
        statuses = trial.check_statuses
        failed = [check for check, status in statuses.items() if status in _CAUGHT]
        if "grader_error" in statuses.values():
            raise CorpusError(f"The exam of {exam} itself fails on {mutation}: {trial.difference}.")
        if failed:
            result.caught[mutation] = failed
        else:
            result.survivors.append(mutation)
        say(f"{'caught' if failed else 'SURVIVES'}  {mutation}")

    trials.run(cases, source, released, jobs=jobs, trust=trust, done=note)
    places = [mutation for _, _, mutation in found]
    result.survivors.sort(key=places.index)
    return result


def _solutions(source: NotebookNode) -> Iterator[tuple[str, str]]:
    """Yield the grade id and the text of each cell of code that a student writes."""
    for cell in source.cells:
        if cell.cell_type == "code" and submission.nbgrader_metadata(cell).get("solution"):
            yield submission.grade_id(cell), without_markers(cell.source)
