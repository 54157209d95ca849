"""The rig of an exam of several nodes: each check says which one it examines."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from typing import Any

from autograder.examination.check_context import CheckContext, StudentError, SubjectGone
from autograder.examination.draws import Draws
from autograder.examination.exam import Failed, NotExaminable
from autograder.observe.examiner.examiner_end import ExaminerEnd
from autograder.observe.nouns import Task
from autograder.observe.several_nodes.clock_bound_node import ClockBoundNode
from autograder.observe.several_nodes.plain_programs import ObservedProgram
from autograder.observe.several_nodes.program_trials import ProgramTrials, TrialTable
from autograder.observe.stillness import Stillness


class Nodes:
    """Gives a check the node that it examines, one at a time, on simulated time."""

    def __init__(self, bench: CheckContext, trials: TrialTable) -> None:
        """Bring up the examiner's end; nodes come with the checks."""
        bench.session.participate()
        self._bench, self._still = bench, Stillness(bench.outside)
        self._end: Any = bench.session.run(ExaminerEnd)
        self._present: tuple[Task, ClockBoundNode] | None = None
        self._trials = ProgramTrials(bench, self._still, trials)
        self.draws: Draws = bench.draws

    def node(self, task: Task, *, fresh: bool = False, new_session: bool = False) -> ClockBoundNode:
        """Return the node of a task, on simulated time that only `advance` moves.

        The check before has left it there if it has passed, and was about the same node: what that
        did must not matter. After one that failed there is a new session, as callbacks may be left
        that never end; else another would have to be discovered first.

        Args:
            task: what it is connected to.
            fresh: it is made anew, in any case.
            new_session: so is its session, whose time begins at 0. In one where time has gone on, a
                thread that a constructor starts has to catch up with it first.

        Raises:
            StudentError: it cannot be made.
            Failed: it lacks an endpoint of the task.
        """
        if self._present is None or self._present[0] is not task or fresh or new_session:
            before, self._present = self._present, None
            if before and not new_session and before[0].threads == task.threads:
                self._bench.subject.stop(before[0].node)
            else:
                self._bench.subject.open(threads=task.threads, sim_time=True)
                self._bench.subject.mark("beside")  # the first node starts the executor's threads
                self._end.now_s = 0.0
            self._present = task, ClockBoundNode(self._bench, task, self._end, self._still)
        return self._present[1]

    def discard_session(self) -> None:
        """Have the next node made in a new session: in this one, something is still under way."""
        self._present = None

    def require_no_errors(self, *trials: str) -> None:
        """Require that nothing leaves a callback of the present node's.

        Args:
            trials: what was done to it, as far as that is done in a plain program, too.

        Raises:
            Failed: something does.
            NotExaminable: it was not found out.
        """
        task, node = self._present_node()
        node.require_no_errors()
        for trial in trials:
            self._trials.require_survival(task.node, trial)

    def require_times(self, *names: str) -> None:
        """Require that times of the present node are right in a plain program, too.

        Args:
            names: those of `autograder.observe.several_nodes.program_trials.NodeTrials.times`.

        Raises:
            Failed: one is far too long or far too short there.
            NotExaminable: one cannot be told.
        """
        self._trials.require_times(self._present_node()[0].node, *names)

    @contextmanager
    def run_program(self, task: Task) -> Iterator[ObservedProgram | None]:
        """Run the node of a task in a plain program that calls its ``shutdown()`` when interrupted.

        It gives None where there are no such programs.

        Raises:
            NotExaminable: the node could not be made there.
        """
        if self._bench.programs is None:
            yield None
            return
        with self._bench.programs.program(
            [(task.node, ())], threads=task.threads, sim_time=True, shut_down=True
        ) as program:
            if not program.up:  # though it was made when the harness asked for it
                raise NotExaminable(
                    f"{task.node} could not be made in a program of its own. After a hand-in a "
                    "person looks at it."
                )
            yield ObservedProgram(program, self._still, [task])

    def call(self, method: str, expected: str, when: str, timeout_s: float) -> float:
        """Call a method of the present node's while its time stands still.

        Args:
            method: its name.
            expected: what is needed if it does not return, a sentence.
            when: what goes on in the node: "in the middle of a drive".
            timeout_s: seconds of wall time that it has.

        Returns:
            How long it took, in s of wall time.

        Raises:
            Failed: it raised, or has not returned in time; the program is gone then.
        """
        task, _ = self._present_node()
        began = time.monotonic()
        try:
            self._bench.subject.call(task.node, method, timeout=timeout_s)
        except StudentError as error:
            raise Failed(
                expected=f"{task.node} has a method {method}() that does not raise {when}.",
                actual=error.feedback_text,
            ) from None
        except SubjectGone as gone:
            if not self._bench.subject.hangs:
                raise
            raise Failed(
                expected=expected,
                actual=f"Called {when}, it had not returned {timeout_s:.0f} s later. The node's "
                "clock stands still during the call: does it wait for that, or for a callback?",
            ) from gone
        return time.monotonic() - began

    def _present_node(self) -> tuple[Task, ClockBoundNode]:
        if self._present is None:
            raise RuntimeError("no node has been made")
        return self._present

    @contextmanager
    def for_check(self) -> Iterator[Nodes]:
        """Keep the present node for the next check, unless this one fails: it may hang then."""
        try:
            yield self
        except BaseException:
            self._present = None
            raise

    def close(self) -> None:
        """Take the examiner's end down."""
        self._bench.session.stop(self._end)


def several_nodes(
    trials: TrialTable,
) -> Callable[[CheckContext], AbstractContextManager[Nodes]]:
    """Return what an `Exam` of several nodes takes: each check gets `Nodes`, and asks for one.

    Args:
        trials: what is done to the nodes in plain programs, once they were right in a session.

    Example:
        >>> from std_msgs.msg import String
        >>> from autograder.examination.exam import Exam
        >>> from autograder.observe.nouns import Topic
        >>> talker = Task("Talker", publishes=[Topic("chatter", String)])
        >>> exam = Exam("talkers", several_nodes({}))
        >>> # In a check: ``nodes.node(talker).advance(1.0)``
    """

    return lambda bench: closing(Nodes(bench, trials))
