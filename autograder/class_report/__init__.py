"""What a graded class shows its instructor: a page, exports, and hints where to look."""

from __future__ import annotations

from course.errors import CourseError


class ClassReportError(CourseError):
    """A class report that cannot be made or written; the message says why and what to do."""
