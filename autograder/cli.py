"""The ``autograder`` command."""

from __future__ import annotations

import io
import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from autograder.commands import marks_command, new_command, quiz_command
from autograder.commands.options import AsJson, Root, use_root, use_root_if_any
from autograder.running.interruption import Stopped
from autograder.util.terminal import Terminal, visible_json
from course.errors import CourseError

EXIT_DIFFERENT = 1
"""The work was done, and something did not come out as it must (a corpus case, the demo)."""

app = typer.Typer(
    name="autograder",
    help="Build, release and grade ROS 2 exercises by what the nodes do.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(marks_command.app, name="marks")
app.add_typer(new_command.app, name="new")
app.add_typer(quiz_command.app, name="quiz")
out = Terminal()
err = Terminal(stderr=True)

IN_FLIGHT = 5 * (os.cpu_count() or 1)
"""Notebooks run at a time: most of its time a subject waits, for DDS or a timer.

With fewer than five a processor it has nothing to do now and then, for up to a tenth of the time.
"""
Jobs = Annotated[int, typer.Option("--jobs", "-j", min=1, help="Notebooks run at a time.")]


@app.command()
def build(
    root: Root = None,
    check: Annotated[
        bool, typer.Option("--check", help="Only say whether all is in step.")
    ] = False,
    with_solutions: Annotated[
        bool, typer.Option("--with-solutions", help="Keep the chapters' solutions.")
    ] = False,
) -> None:
    """Build the notebooks from their text sources."""
    from autograder import exercises
    from autograder.assignments import chapter_sections, listing
    from autograder.assignments.build_notebooks import build as build_notebooks

    where = use_root(root)
    listed = {name for one in listing.of_course(where).values() for name in one.exercises}
    for name in sorted(listed):
        exercises.require_sound(name)
    sections = chapter_sections.find_sections(where)
    for name in sorted(listed & exercises.own_names()):
        chapter_sections.require_sections(sections, name, exercises.where_to_read(name))
    for path in build_notebooks(where, check=check, with_solutions=with_solutions):
        out.print(str(path), soft_wrap=True)
    for name in sorted(exercises.own_names() - listed):
        err.print(f"The exercise '{name}' is in no assignment: {listing.ASSIGNMENTS} lists them.")


@app.command()
def release(assignment: str, root: Root = None) -> None:
    """Make the student version of an assignment with nbgrader."""
    from autograder.gradebook.release import make_release as release_assignment

    out.print(str(release_assignment(use_root(root), assignment)), soft_wrap=True)


@app.command()
def grade(
    assignment: str,
    root: Root = None,
    student: Annotated[
        list[str] | None, typer.Option("--student", help="Only this one; may be repeated.")
    ] = None,
    jobs: Jobs = IN_FLIGHT,
    fresh: Annotated[bool, typer.Option("--fresh", help="Also run what did not change.")] = False,
    trust: Annotated[
        bool,
        typer.Option(
            "--trust-submissions", help="Run them without a sandbox, with your own rights."
        ),
    ] = False,
    scheduler: Annotated[
        str,
        typer.Option(
            "--scheduler",
            help="Run the notebooks on the workers of this Dask scheduler, as in tcp://host:8786.",
        ),
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Grade what is in ``submitted/`` into the gradebook, write feedback and all its grades as CSV.

    What has not changed since it was graded is left as it is. A run that was ended, however, goes
    on where it was when it is started again.
    """
    from autograder import sandbox

    if not trust and not scheduler:
        sandbox.warm_up()  # while nbgrader is imported, which takes seconds
    from autograder.class_report.platforms import grades_csv
    from autograder.gradebook.course_gradebook import CourseGradebook
    from autograder.grading import engine, run_progress

    where = use_root(root)
    done = engine.grade(
        where, assignment, students=student or (), jobs=jobs, fresh=fresh, trust=trust,
        scheduler=scheduler, progress=run_progress.for_console(out, err, machine=as_json),
    )  # fmt: skip
    gradebook = CourseGradebook(where)
    every = {name: gradebook.read_grades(name) for name in gradebook.assignment_names()}
    meant = {graded.student for graded in done}
    grades = [grade for grade in every[assignment] if not student or grade.student in meant]
    grades_csv.write_grades(every, where / "grades.csv")
    problems = {
        graded.student: graded.problem if graded.entered else f"NOT ENTERED: {graded.problem}"
        for graded in done
        if graded.problem
    }
    if as_json:
        _print_json({"grades": [vars(grade) for grade in grades], "problems": problems})
    else:
        _grades_table(grades, problems)
        places = (where / "gradebook.db", where / "feedback", where / "grades.csv")
        out.print(f"Written: {', '.join(map(str, places))}", soft_wrap=True)
    if any(not graded.entered for graded in done):
        raise typer.Exit(EXIT_DIFFERENT)


@app.command()
def watch(
    assignment: str,
    root: Root = None,
    every_s: Annotated[
        float, typer.Option("--every", min=0.1, help="Seconds between two looks.")
    ] = 60.0,
    jobs: Jobs = IN_FLIGHT,
    trust: Annotated[
        bool,
        typer.Option(
            "--trust-submissions", help="Run them without a sandbox, with your own rights."
        ),
    ] = False,
    scheduler: Annotated[str, typer.Option("--scheduler", help="As for `autograder grade`.")] = "",
) -> None:
    """Collect from nbgrader's exchange, grade what is new, release feedback; until it is stopped.

    It says one line when something has happened, and nothing otherwise. Killed at any moment, it
    goes on where it was when it is started again. You may grade by hand beside it.
    """
    from autograder.commands import watch_command

    options = watch_command.GradingOptions(jobs, trust, scheduler)
    watch_command.watch_assignment(
        use_root(root), assignment, options, every_s=every_s, say=_line_printer(False)
    )


@app.command()
def collect(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE.zip",
            help="What “Download all submissions” (Moodle) or “Download Submissions” (Canvas) "
            "made.",
        ),
    ],
    assignment: Annotated[
        str, typer.Option("--assignment", help="If the names of the files do not say which it is.")
    ] = "",
    who: Annotated[
        list[str] | None,
        typer.Option(
            "--who",
            metavar="NUMBER=STUDENT",
            help="Whose the platform's number is, where the name does not say it; may be repeated.",
        ),
    ] = None,
    root: Root = None,
    as_json: AsJson = False,
) -> None:
    """Collect what students handed in on Moodle or Canvas, from the zip file downloaded there.

    Who is meant is found by the students' names in nbgrader's gradebook (`nbgrader db student
    import`), in Canvas also by the lms_user_id. Work that differs from what lies in submitted/
    replaces it; the earlier one is kept beside it, as .ASSIGNMENT.replaced.
    """
    from autograder.gradebook.collecting.collect_zip import collect_zip
    from autograder.gradebook.course_gradebook import CourseGradebook
    from autograder.grading import engine
    from course.messages.yaml_text import format_count

    pairs = [one.partition("=") for one in who or ()]
    if not all(number and student for number, _, student in pairs):
        raise typer.BadParameter("as in 123456=ada", param_hint="--who")
    where = use_root(root)
    done = collect_zip(
        CourseGradebook(where), file, assignment, {n: s for n, _, s in pairs},
        lambda: engine.lock_course(where),
    )  # fmt: skip
    if as_json:
        _print_json(vars(done))
    else:
        for sentence in (*done.problems, *done.remarks):
            out.print(sentence, soft_wrap=True)
        out.print(
            f"{done.assignment}: {format_count(len(done.collected), 'submission')} collected "
            f"({len(done.replaced)} in place of an earlier one), {len(done.unchanged)} as before, "
            f"{len(done.problems)} not collected.",
            soft_wrap=True,
        )
    if done.problems:
        raise typer.Exit(EXIT_DIFFERENT)


@app.command()
def claim(
    assignment: str,
    student: str,
    notebook: Annotated[
        str, typer.Argument(help="Its name; for a quiz's attempts the quiz, as in quiz-ch05.")
    ],
    file: Annotated[
        str,
        typer.Argument(
            help="Where it lies in the submission, in a zip file as in hand-in.zip/work.ipynb."
        ),
    ] = "",
    nothing: Annotated[
        bool, typer.Option("--nothing", help="Nothing was handed in: zero points, for good.")
    ] = False,
    withdraw: Annotated[
        bool, typer.Option("--withdraw", help="Take back what was said before.")
    ] = False,
    root: Root = None,
) -> None:
    """Say which file of a submission is a student's notebook, where names do not say it.

    The next ``autograder grade`` uses it, and asks nothing more about it. What was handed in is not
    touched: claims are kept in claims.json of the course root. A claim holds until the student
    hands in again.
    """
    from autograder.commands import claim_command

    said = claim_command.keep_claim(
        use_root(root), assignment, student, notebook, file, nothing=nothing, withdraw=withdraw
    )
    out.print(said, soft_wrap=True)


@app.command()
def extend(
    assignment: str,
    students: Annotated[list[str], typer.Argument(help="One or several.")],
    hours: Annotated[
        float, typer.Option("--hours", min=0, help="Beyond the due date; 0 takes it away.")
    ],
    root: Root = None,
) -> None:
    """Give students more time for an assignment, in place of an earlier extension of theirs."""
    from autograder.gradebook import extensions

    for due in extensions.grant_extensions(use_root(root), assignment, students, hours):
        then = (
            "it counts once the work is graded."
            if due.waits
            else f"run `autograder grade {assignment}`, and the penalty is reckoned again."
        )
        line = f"{due.student}: due {due.time:%Y-%m-%d %H:%M} UTC; {then}"
        out.print(line, soft_wrap=True)


@app.command()
def corpus(
    exercise: Annotated[
        str, typer.Option("--exercise", help="Which exam's corpus; all if left out.")
    ] = "",
    case: Annotated[list[str] | None, typer.Option("--case", help="Only this case.")] = None,
    repeat: Annotated[int, typer.Option("--repeat", min=1, help="Runs of each case.")] = 1,
    load: Annotated[int, typer.Option("--load", min=0, help="Busy loops beside it.")] = 0,
    seed: Annotated[
        int,
        typer.Option(
            "--seed",
            min=0,
            help="What the numbers of an exam are drawn from, as a verdict tells it. What cases "
            "must say is worded for 0, so with another seed look at right cases.",
        ),
    ] = 0,
    jobs: Jobs = IN_FLIGHT,
    root: Root = None,
    as_json: AsJson = False,
    as_table: Annotated[
        bool, typer.Option("--table", help="Run nothing; print which mutant each check catches.")
    ] = False,
) -> None:
    """Grade the graders: run every case of known verdict, and compare."""
    from autograder.corpus import command, tables

    use_root_if_any(root)
    if as_table:
        sys.stdout.write(tables.checks_matrix(command.load_cases(exercise)))
        return
    trials = command.run_corpus(
        exercise, only=case or (), repeat=repeat, jobs=jobs, load=load, seed=seed,
        say=_line_printer(as_json),
    )  # fmt: skip
    different = [trial for trial in trials if trial.difference]
    flips = tables.all_flips(trials)
    if as_json:
        _print_json(tables.as_data(trials))
    else:
        out.print(tables.trials_table(trials))
        out.print(
            f"{len(trials)} runs: {len(different)} with another verdict than expected, "
            f"{len(flips)} checks that changed between repeats."
        )
        for line in (*flips, *(f"{t.case.name}: {t.difference}" for t in different)):
            out.print(f"  {line}", soft_wrap=True)
    if different or flips:
        raise typer.Exit(EXIT_DIFFERENT)


@app.command("try")
def try_(
    exercise: str,
    what: Annotated[
        str, typer.Argument(help="A case of its corpus, or a notebook's file; else its exemplar.")
    ] = "",
    watch: Annotated[
        bool, typer.Option("--watch", help="And again as soon as one of its files changes.")
    ] = False,
    root: Root = None,
) -> None:
    """Run an exam once, and show what it did and saw, step by step."""
    from autograder.commands import try_command

    use_root_if_any(root)
    if watch:
        try_command.try_again_and_again(exercise, what, say=_line_printer(False))
        return
    tried = try_command.try_exam(exercise, what, say=_line_printer(False))
    for line in tried.as_lines():
        out.print(line, soft_wrap=True)
    if tried.difference:
        raise typer.Exit(EXIT_DIFFERENT)


@app.command()
def mutate(
    exercise: str, jobs: Jobs = IN_FLIGHT, root: Root = None, as_json: AsJson = False
) -> None:
    """Make a student's small mistakes in an exemplar, one at a time, and list what passes its exam.

    What survives is a check that is missing, or changes nothing: then say why in the table
    "equivalent" of the exercise's corpus/mutants.toml.
    """
    from autograder.corpus import mutate as mutating

    use_root_if_any(root)
    done = mutating.mutate(exercise, jobs=jobs, say=_line_printer(as_json))
    if as_json:
        _print_json({
            "caught": {m.key: checks for m, checks in done.caught.items()},
            "survivors": [vars(mutation) for mutation in done.survivors],
            "equivalent": {m.key: why for m, why in done.equivalent.items()},
            "stale": done.stale,
        })  # fmt: skip
    else:
        out.print(
            f"{len(done.caught)} caught, {len(done.survivors)} survive, "
            f"{len(done.equivalent)} are known to change nothing."
        )
        for mutation in done.survivors:
            key = json.dumps(mutation.key, ensure_ascii=False)  # as TOML has it, too
            out.print(f"  {mutation}\n    key: {key}", soft_wrap=True)
        for key in done.stale:
            key = json.dumps(key, ensure_ascii=False)
            out.print(f"  There is no such mutation any more: {key}", soft_wrap=True)
    if done.survivors or done.stale:
        raise typer.Exit(EXIT_DIFFERENT)


@app.command()
def report(
    assignment: str,
    root: Root = None,
    column: Annotated[
        str,
        typer.Option(
            "--column",
            help="The assignment's name in Canvas or Moodle; in Canvas with its id, as in "
            "'Exercise 1 (4711)'. The name here if left out.",
        ),
    ] = "",
    provisional: Annotated[
        bool, typer.Option("--provisional", help="Also export grades that wait for a person.")
    ] = False,
    zero_absent: Annotated[
        bool, typer.Option("--zero-absent", help="Export 0 for those who handed in nothing.")
    ] = False,
    similarity: Annotated[
        float, typer.Option("--similarity", min=0.7, max=1.0, help="Show pairs at least so alike.")
    ] = 0.9,
    as_json: AsJson = False,
) -> None:
    """Show the grades of an assignment, what still needs a person, and how its checks went.

    A quiz's name stands for the assignment that it is in.

    Writes into reports/ASSIGNMENT of the course root: class-report.html, which opens in any
    browser and needs no network, and two exports.

    canvas.csv is for Canvas: Grades, Import. Its columns are Student, ID, SIS User ID, SIS Login
    ID, Section and the assignment; its first row is Points Possible. A student's folder name is
    their SIS Login ID; ID is the lms_user_id of nbgrader's gradebook, if it is set there.

    moodle.csv is for Moodle: Grades, Import, CSV file. Its columns are Username (the folder
    name), ID number (the lms_user_id), First name, Last name, Email address and the assignment,
    in points: map Username, or another that identifies your users, and the assignment's grade
    item.

    Both have everybody whom nbgrader's gradebook knows. The cell of a student whose grade still
    waits for a person is empty, and so is that of one who handed in nothing (unless --zero-absent
    says that this is a 0): both platforms take an empty cell for "no grade", and delete one that
    is there.
    """
    from autograder.commands import quiz_report, report_command

    where = use_root(root)
    assignment = quiz_report.assignment_of(where, assignment)
    made = report_command.make_report(
        where, assignment, column=column, provisional=provisional, threshold=similarity,
        zero_absent=zero_absent,
    )  # fmt: skip
    grades = made.report.data.grades
    quizzes = quiz_report.of_assignment(where, assignment)
    if as_json:
        data = [quiz.as_data() for quiz in quizzes]
        shown = {"grades": [vars(grade) for grade in grades], "quizzes": data, **made.as_data()}
        _print_json(shown)
        return
    _grades_table(list(grades), {})
    out.print(*made.as_tables(), sep="\n")
    for remark in made.remarks:
        out.print(remark, soft_wrap=True)
    out.print(f"Written: {', '.join(map(str, made.files))}", soft_wrap=True)
    for quiz in quizzes:
        out.print(*quiz.as_tables(), sep="\n")
        out.print(f"Written: {', '.join(map(str, quiz.files))}", soft_wrap=True)


@app.command()
def feedback(
    assignment: str,
    platform: Annotated[
        str, typer.Option("--platform", help="Where it is uploaded: moodle or canvas.")
    ],
    names: Annotated[
        Path,
        typer.Option(
            "--names",
            help="What you downloaded there: the archive of submissions (or its folder), or "
            "Moodle's grading worksheet.",
        ),
    ],
    to: Annotated[Path | None, typer.Option("--zip", help="The archive to write.")] = None,
    root: Root = None,
    as_json: AsJson = False,
) -> None:
    """Write all feedback on an assignment as an archive that Moodle or Canvas hands out.

    Both know a student by numbers of their own, which stand in the names of what they let you
    download, so that download is needed; whose is whose is found by the files themselves, or by
    name, address or number. In Moodle: the assignment, “Upload multiple feedback files in a zip”
    (feedback files have to be on). In Canvas: the assignment in SpeedGrader's menu or the
    gradebook, “Upload Submissions”; only those who handed in a file can be given one back, under
    the name of theirs.
    """
    from autograder.class_report.platforms import feedback_archive
    from course.messages.yaml_text import format_count

    if platform not in ("moodle", "canvas"):
        raise typer.BadParameter("moodle or canvas", param_hint="--platform")
    where = use_root(root)
    file = to or where / "reports" / assignment / f"feedback-{platform}.zip"
    packed = feedback_archive.pack_feedback(where, assignment, platform, names, file)  # type: ignore[arg-type]
    if as_json:
        _print_json(vars(packed))
        return
    out.print(
        f"Feedback for {format_count(len(packed.students), 'student')}: {file}", soft_wrap=True
    )
    for why, who in packed.left_out.items():
        out.print(f"Not in it, {why}: {', '.join(who)}.", soft_wrap=True)


@app.command()
def wheelhouse(
    folder: Annotated[Path, typer.Argument(help="Such as a USB stick's.")],
    wheel: Annotated[
        Path | None,
        typer.Option("--wheel", help="The course's own wheel, if it cannot be built here."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a folder from which the course installs without any network; its README.txt says how.

    It has the wheels of the course, of ROS 2 and of all that they need, at the versions that were
    tested, for this version of Python. Making it needs a network.
    """
    from autograder.commands import wheelhouse_command

    done = wheelhouse_command.make_wheelhouse(folder, wheel, say=_line_printer(as_json))
    if as_json:
        _print_json(vars(done))
    else:
        out.print(
            f"{done.count} wheels, {done.size / 1e6:.0f} MB: {done.folder}. How to install from "
            f"them stands in {done.folder / wheelhouse_command.README}.",
            soft_wrap=True,
        )


@app.command()
def demo(
    folder: Annotated[
        Path, typer.Option("--dir", help="Where to work; an earlier demo there is replaced.")
    ] = Path("ros2-course-demo"),
    every: Annotated[
        bool, typer.Option("--all", help="All exercises, which takes some minutes.")
    ] = False,
    jobs: Jobs = 2,
    as_json: AsJson = False,
) -> None:
    """Build, release, collect a bundled class, grade it on real DDS, and show the grades."""
    from autograder.commands import demo_command
    from autograder.grading import run_progress

    shown = run_progress.for_console(out, err, machine=as_json)
    done = demo_command.run_demo(
        folder, every=every, jobs=jobs, say=_line_printer(as_json), progress=shown
    )
    if as_json:
        rows = [{**vars(row), "grade": vars(row.grade)} for row in done.rows]
        _print_json({"root": str(done.root), "rows": rows, "as_expected": done.as_expected})
    else:
        _demo_table(done)
    if not done.as_expected:
        raise typer.Exit(EXIT_DIFFERENT)


def _demo_table(done: Any) -> None:
    table = Table("Student", "What is special", "Must fail", "Points", "Verdict", padding=(0, 0))
    for column in (0, 3):
        table.columns[column].no_wrap = True
    for row in done.rows:
        score = f"{row.grade.score:g} of {row.grade.max_score:g}"
        table.add_row(row.student, row.title, row.expected, score, row.difference or "as expected")
    out.print(table)
    out.print("A quarter of the points is for written explanations, which a person grades.")
    places = {
        "gradebook": done.root / "gradebook.db",
        "grades": done.csv,
        "feedback": done.root / "feedback",
        "formgrader": f"run `jupyter lab` in {done.root}",
    }
    for what, path in places.items():
        out.print(f"{what:>11}: {path}", soft_wrap=True)


def _grades_table(grades: list[Any], problems: dict[str, str]) -> None:
    from autograder.grading import grades_table

    out.print(grades_table.make_table(grades, problems))


def _line_printer(silent: bool) -> Any:
    return (lambda _line: None) if silent else (lambda line: out.print(line, soft_wrap=True))


def _print_json(data: Any) -> None:
    sys.stdout.write(visible_json(json.dumps(data, default=str, ensure_ascii=False)) + "\n")


def main() -> None:
    """Run the command; a `CourseError` is printed as its sentence, with its exit code."""
    for stream in (sys.stdout, sys.stderr):
        # The name of a student's folder may be no text in any encoding.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        app()
    except CourseError as error:
        err.print(f"autograder: {error}", soft_wrap=True)
        sys.exit(error.exit_code)
    except OSError as error:
        where = f" ({error.filename})" if error.filename else ""
        err.print(
            f"autograder: {error.strerror or error}{where}: make room there or choose another "
            "folder, then run the same command again; what was graded so far is kept.",
            soft_wrap=True,
        )  # fmt: skip
        sys.exit(1)
    except Stopped as stop:
        err.print(
            "autograder: stopped; what was graded so far is kept, and the same command goes on.",
            soft_wrap=True,
        )
        sys.exit(128 + stop.signum)
