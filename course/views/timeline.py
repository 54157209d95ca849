"""When messages were published, received and worked on: lanes, latency and rate, live."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from course import mcap_file
from course.errors import SessionError
from course.runtime.recorder import Recorder
from course.runtime.session import Session
from course.views.live import Frame, LiveView
from course.watch import timeline
from course.watch.callbacks import CallbackTap, Run
from course.watch.timeline import Figures, Passage, Trace

MOST_TOPICS = 6
"""Topics that one timeline shows: more lanes than that nobody can follow."""


class Timeline(LiveView):
    """Lanes of a few topics over the last seconds.

    Each topic has a lane of publications and receptions, one of callbacks for each node that reads
    it, and figures: rate, median and 95th percentile of the latency from publication to reception
    (on one machine: both stamps are of its clock), gaps, and messages that never arrived.
    """

    label = "Timeline"
    script = "timeline"
    period = 0.25  # s

    def __init__(
        self, session: Session, topics: list[tuple[str, Any | None]], window: float = 10.0
    ) -> None:
        """Show ``topics`` (names and message classes) over the last ``window`` s.

        Raises:
            SessionError: no topic, too many, or a window that is not positive.
            WaitTimeout: a topic without a class that nobody uses.
        """
        super().__init__(session)
        if not 0 < len(topics) <= MOST_TOPICS:
            raise SessionError(f"A timeline shows 1 to {MOST_TOPICS} topics, not {len(topics)}.")
        if not 0 < window <= 60:
            raise SessionError(f"A timeline shows up to 60 s, not {window:g} s.")
        self._window = round(window * 1e9)
        self._rows: list[tuple[Trace, CallbackTap, Recorder]] = []
        for name, msg_type in topics:
            trace = Trace(session, name, msg_type)
            recorder = session.record(trace.topic, trace.msg_type)
            self._rows.append((trace, CallbackTap(trace.topic), recorder))
        self._tap()
        session.on_close(self.stop)

    def figures(self) -> dict[str, Figures]:
        """Return the figures of each topic over the window that ends now."""
        start = time.time_ns() - self._window
        return {trace.topic: timeline.figures(trace.since(start)) for trace, _, _ in self._rows}

    def runs(self, topic: str) -> list[Run]:
        """Return when callbacks of a topic's subscriptions ran in the window that ends now."""
        start = time.time_ns() - self._window
        return [
            run for trace, tap, _ in self._rows if trace.topic == topic for run in tap.since(start)
        ]

    def save(self, path: str | Path) -> Path:
        """Write the last messages of all topics (up to 1000 each) to an MCAP file; return its path.

        Raises:
            RecordingError: the file cannot be written.
        """
        recordings = {
            trace.topic: (trace.msg_type, recorder.messages) for trace, _, recorder in self._rows
        }
        return mcap_file.write(path, recordings)

    def stop(self) -> None:
        """Trace no more, and leave callbacks as they were. Idempotent."""
        for trace, tap, recorder in self._rows:
            tap.stop()
            if not self.session.closed:
                trace.stop()
                recorder.stop()

    def frame(self) -> Frame:
        """Return lanes as counts a column, and figures in words."""
        self._tap()
        now = time.time_ns()
        # Columns stay where they are while time passes: the window moves on by whole ones.
        step = self._window // timeline.COLUMNS
        start = (now // step + 1) * step - self._window
        return {
            "window": self._window / 1e9,
            "columns": timeline.COLUMNS,
            "topics": [self._topic(trace, tap, start) for trace, tap, _ in self._rows],
        }

    def words(self) -> str:
        """Return the figures of each topic."""
        lines = [f"The last {self._window / 1e9:g} s"]
        for topic, found in self.figures().items():
            lines.append(f"  {topic}: {describe(found)}")
            for node, count in self._nodes(topic).items():
                lines.append(f"    callbacks of {node}: {count}")
        return "\n".join(lines)

    def _tap(self) -> None:
        nodes = list(self.session.nodes.values())
        for _, tap, _ in self._rows:
            tap.watch(nodes)

    def _nodes(self, topic: str) -> dict[str, int]:
        counts: dict[str, int] = {}
        for run in self.runs(topic):
            counts[run.node] = counts.get(run.node, 0) + 1
        return counts

    def _topic(self, trace: Trace, tap: CallbackTap, start: int) -> dict[str, Any]:
        passages, runs = trace.since(start), tap.since(start)
        found = timeline.figures(passages)
        lanes = [
            ("published", [passage.published for passage in passages]),
            ("received", [passage.received for passage in passages]),
        ]
        for node in sorted({run.node for run in runs}):
            lanes.append((f"callback of {node}", [r.started for r in runs if r.node == node]))
        return {
            "name": trace.topic,
            "text": describe(found),
            "lanes": [
                {"label": label, "counts": timeline.columns(moments, start, self._window)}
                for label, moments in lanes
            ],
            "latency": _latency(passages, start, self._window),
            "gaps": [
                [(moment - start / 1e9) / (self._window / 1e9) for moment in gap]
                for gap in found.gaps
            ],
        }


def describe(figures: Figures) -> str:
    """Return figures in words."""
    if not figures.count:
        return "nothing"
    parts = [f"{figures.count} messages"]
    if figures.rate is not None:
        parts.append(f"{figures.rate:.1f} Hz")
    if figures.latency_p50 is not None and figures.latency_p95 is not None:
        median, late = figures.latency_p50 * 1e3, figures.latency_p95 * 1e3
        parts.append(f"latency p50 {median:.2f} ms, p95 {late:.2f} ms")
    longest = max((end - begin for begin, end in figures.gaps), default=0.0)
    if figures.gaps:
        count = len(figures.gaps)
        parts.append(f"{count} gap{'s' if count > 1 else ''}, the longest {longest:.2f} s")
    if figures.lost:
        parts.append(f"{figures.lost} lost on the way")
    return ", ".join(parts)


def _latency(passages: list[Passage], start: int, window: int) -> list[float | None]:
    """Return the largest latency (ms) of each column, None for an empty one."""
    worst: list[float | None] = [None] * timeline.COLUMNS
    for passage in passages:
        place = (passage.received - start) * timeline.COLUMNS // window
        if 0 <= place < timeline.COLUMNS:
            latency = round((passage.received - passage.published) / 1e6, 3)
            worst[place] = max(worst[place] or 0.0, latency)
    return worst
