"""Who in nbgrader's gradebook is meant by a platform's name."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from autograder.assignments.intake.handed_files.download_names import letters_of
from autograder.gradebook.collecting.platform_zip import DownloadError, HandIn
from autograder.gradebook.course_gradebook import CourseGradebook
from course.util.close_matches import is_it


@dataclass(frozen=True)
class Student:
    """A student as the gradebook knows them; what it does not know is empty."""

    student: str
    first_name: str = ""
    last_name: str = ""
    email: str = ""
    lms_user_id: str = ""

    @property
    def names(self) -> frozenset[str]:
        """What a platform may call this student, as letters: first name first, or last name."""
        first, last = self.first_name, self.last_name
        every = (f"{first}{last}", f"{last}{first}", self.email, self.student)
        return frozenset(filter(None, map(letters_of, every)))


@dataclass(frozen=True)
class Matches:
    """{student: what they handed in}, and a sentence for each that fits nobody, or several."""

    found: Mapping[str, HandIn]
    problems: tuple[str, ...]


def read_students(gradebook: CourseGradebook) -> list[Student]:
    """Return the students that the gradebook knows.

    Raises:
        DownloadError: there are none, so that nobody can be found by name.
    """
    with gradebook.open_gradebook() as book:
        found = [
            Student(s.id, s.first_name or "", s.last_name or "", s.email or "", s.lms_user_id or "")
            for s in book.students
        ]
    if not found:
        raise DownloadError(
            f"The gradebook of {gradebook.root} has no students yet, so nobody can be found by "
            "name: import them with `nbgrader db student import FILE.csv` (columns id, first_name, "
            "last_name, email, lms_user_id), then run the same command again."
        )
    return found


def match_students(
    hand_ins: Iterable[HandIn],
    students: Iterable[Student],
    said: Mapping[str, str],
    *,
    users: bool,
) -> Matches:
    """Find out whose is what.

    Args:
        hand_ins: what is in a download.
        students: those of the gradebook.
        said: {platform's number: student}, as a person said it.
        users: the numbers are those of users (Canvas), which the gradebook may know.
    """
    students = list(students)
    by_name: defaultdict[str, set[str]] = defaultdict(set)
    for student in students:
        for name in student.names:
            by_name[name].add(student.student)
    by_number = {s.lms_user_id: s.student for s in students if users and s.lms_user_id}
    meant: defaultdict[str, list[HandIn]] = defaultdict(list)
    problems = []
    for one in hand_ins:
        sure = said.get(one.number) or by_number.get(one.number)
        fits = {sure} if sure else _students_named(one.who, by_name)
        if len(fits) == 1:
            meant[fits.pop()].append(one)
        else:
            problems.append(_whose_problem(one, fits, students))
    several = {student: these for student, these in meant.items() if len(these) > 1}
    problems += [_several_problem(student, these) for student, these in several.items()]
    return Matches(
        {student: these[0] for student, these in meant.items() if student not in several},
        tuple(problems),
    )


def _students_named(who: str, by_name: Mapping[str, set[str]]) -> set[str]:
    for name in _possible_names(who):
        if found := by_name.get(letters_of(name)):
            return set(found)
    return set()


def _possible_names(who: str) -> Iterator[str]:
    """Yield a name, and then what is left without a group's name in front (Moodle)."""
    yield who
    parts = who.split("-")
    for first in range(1, len(parts)):
        yield "-".join(parts[first:])


def _whose_problem(one: HandIn, fits: set[str], students: list[Student]) -> str:
    say = f"say who it is with --who {one.number}=STUDENT, and run the same command again."
    if fits:
        names = " and ".join(sorted(fits))
        return f"{one} fits {names}: {say}"
    known = {f"{s.first_name} {s.last_name}".strip() or s.student for s in students}
    guess = is_it(one.who, known) if one.who else ""
    return f"{one} fits nobody in the gradebook{guess}: add the student, or {say}"


def _several_problem(student: str, these: list[HandIn]) -> str:
    named = " and ".join(map(str, these))
    numbers = " ".join(f"--who {one.number}=STUDENT" for one in these)
    return f"{named} fit {student}: say who is who with {numbers}, and run the same command again."
