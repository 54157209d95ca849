"""The corpus: submissions with known verdicts, by which the graders themselves are graded."""

from autograder.corpus.case import Case, CorpusError
from autograder.corpus.corpus_files import load_cases
from autograder.corpus.trials import CorpusTrial, run

__all__ = ["Case", "CorpusError", "CorpusTrial", "load_cases", "run"]
