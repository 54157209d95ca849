"""The corpus: submissions with known verdicts, by which the graders themselves are graded."""

from autograder.corpus.case import Case, CorpusError
from autograder.corpus.files import load_cases
from autograder.corpus.trials import Trial, run

__all__ = ["Case", "CorpusError", "Trial", "load_cases", "run"]
