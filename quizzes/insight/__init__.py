"""What a class knows: item analysis of saved attempts, as a page and as CSV."""

from __future__ import annotations

from quizzes.insight.analysis import Analysis as Analysis
from quizzes.insight.analysis import analyse_results as analyse_results
from quizzes.insight.first_attempts import ClassResults as ClassResults
from quizzes.insight.first_attempts import collect_class as collect_class
from quizzes.insight.item_report import write_report as write_report
