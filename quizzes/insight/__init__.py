"""What a class knows: item analysis of saved attempts, as a page and as CSV."""

from __future__ import annotations

from quizzes.insight.analysis import Analysis as Analysis
from quizzes.insight.analysis import analyse as analyse
from quizzes.insight.collect import ClassResults as ClassResults
from quizzes.insight.collect import collect as collect
from quizzes.insight.report import write as write
