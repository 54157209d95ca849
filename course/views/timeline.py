"""When messages were published, received and worked on: lanes, latency and rate, live."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from course.errors import SessionError
from course.messages import mcap_file
from course.messages.mcap_file import RecordingError
from course.messages.yaml_text import format_count
from course.runtime.core_session import CoreSession
from course.util import argument_checks
from course.views.pictures.timeline_svg import draw_timeline_svg
from course.views.shared.live_view import Frame, LiveView
from course.views.timeline_words import (
    describe_figures,
    describe_newest,
    describe_shortening,
)
from course.watch import timeline
from course.watch.callbacks import CallbackTap, Run
from course.watch.timeline import Figures, Trace

MOST_DROPS = 200
"""Marks for drops that a lane has."""

MOST_TOPICS = 6
"""Topics that one timeline shows: more lanes than that nobody can follow."""


class Timeline(LiveView):
    """Lanes of a few topics over the last seconds.

    Each topic has a lane of publications and receptions, one of callbacks for each node that reads
    it, marks for gaps and drops (lost on the way, or passed by a callback that was too slow for its
    queue), plots of rate and latency, and figures: rate, median and 95th
    percentile of the latency from publication to reception (on one machine: both stamps are of its
    clock), gaps, and messages that never arrived.
    """

    label = "Timeline"
    script = "timeline"
    period = 0.25  # s

    def __init__(
        self, session: CoreSession, topics: list[tuple[str, Any | None]], window: float = 10.0
    ) -> None:
        """Show ``topics`` (names and message classes) over the last ``window`` s.

        Raises:
            SessionError: no topic, too many, or a window that is not positive.
            WaitTimeout: a topic without a class that nobody uses.
        """
        if not 0 < len(topics) <= MOST_TOPICS:
            raise SessionError(f"A timeline shows 1 to {MOST_TOPICS} topics, not {len(topics)}.")
        window = argument_checks.check_seconds(window, "window")
        if not 0 < window <= 60:
            raise SessionError(f"A timeline shows up to 60 s, not {window:g} s.")
        super().__init__(session, *topics, window)
        self._window = round(window * 1e9)
        self._rows: list[tuple[Trace, CallbackTap]] = []
        self._still_ns = 0  # when the last publisher went; 0 while there is one
        self._frame: Frame = {}
        try:
            for name, msg_type in topics:
                self._add_topic(name, msg_type)
        except BaseException:
            self.stop()
            raise
        self._keep_up()

    def figures(self) -> dict[str, Figures]:
        """Return the figures of each topic over the window that ends now."""
        self._keep_up()
        start = time.time_ns() - self._window
        return {
            trace.topic: timeline.compute_figures(trace.passages_since(start))
            for trace, _ in self._rows
        }

    def callback_runs(self, topic: str) -> list[Run]:
        """Return when callbacks of a topic's subscriptions ran in the window that ends now."""
        start = time.time_ns() - self._window
        return [
            run
            for trace, tap in self._rows
            if trace.topic == topic
            for run in tap.runs_since(start)
        ]

    def save(self, path: str | Path) -> Path:
        """Write the last messages of all topics to an MCAP file; return its path.

        These are up to 1000 of each topic, or as many as have 32 MiB.

        Raises:
            RecordingError: the file cannot be written, or this timeline has ended.
        """
        if self.end_reason:
            raise RecordingError(
                "This timeline has ended, and has let its messages go: run its cell again, and "
                "save while it is live."
            )
        recordings = {
            trace.topic: (trace.msg_type, trace.latest_messages) for trace, _ in self._rows
        }
        return mcap_file.write_recordings(path, recordings)

    def make_frame(self) -> Frame:
        """Return lanes as counts a column, and figures in words."""
        self._keep_up()
        return self._frame_at(time.time_ns())

    def words(self) -> str:
        """Return the figures of each topic."""
        self._keep_up()
        return self._words_at(time.time_ns())

    def look(self) -> tuple[Frame, str]:
        """Return both; when the last publisher goes, the window stands still."""
        self._keep_up()
        now = time.time_ns()
        if any(trace.is_published for trace, _ in self._rows):
            self._still_ns = 0
        elif not self._still_ns:
            self._still_ns = now
        self._frame = self._frame_at(self._still_ns or now)
        return self._frame, self._words_at(self._still_ns or now)

    def picture(self) -> str:
        """Return the lanes that were shown last."""
        return draw_timeline_svg(self._frame) if self._frame else ""

    @property
    def standstill(self) -> str:
        """That nobody publishes any more, once somebody did."""
        if not self._still_ns or not any(trace.latest_messages for trace, _ in self._rows):
            return ""
        moment = time.strftime("%H:%M:%S", time.localtime(self._still_ns / 1e9))
        return f"Nobody publishes here any more since {moment}: these are the seconds before."

    def _frame_at(self, now: int) -> Frame:
        # Columns stay where they are while time passes: the window moves on by whole ones.
        step = self._window // timeline.COLUMNS
        start = (now // step + 1) * step - self._window
        return {
            "window": self._window / 1e9,
            "columns": timeline.COLUMNS,
            "bins": timeline.BINS,
            "topics": [self._topic_data(trace, tap, start) for trace, tap in self._rows],
        }

    def _words_at(self, now: int) -> str:
        lines = [f"The last {self._window / 1e9:g} s"]
        start = now - self._window
        for trace, tap in self._rows:
            figures = timeline.compute_figures(trace.passages_since(start))
            text = describe_figures(figures) + describe_shortening(trace, tap, start)
            lines.append(f"  {trace.topic}: {text}")
            if newest := describe_newest(trace):
                lines.append(f"    newest message: {newest}")
            for node, runs in _by_node(tap.runs_since(start)).items():
                missed = sum(count for _, count in timeline.find_drops(runs))
                passed = f", {format_count(missed, 'message')} passed it by" if missed else ""
                lines.append(f"    callbacks of {node}: {len(runs)}{passed}")
        return "\n".join(lines)

    def _add_topic(self, name: str, msg_type: Any | None) -> None:
        trace = Trace(self.session, name, msg_type)
        self.resources.callback(trace.stop)
        tap = CallbackTap(trace.topic)
        self.resources.callback(tap.stop)
        self._rows.append((trace, tap))

    def _keep_up(self) -> None:
        """Follow nodes and publishers that have come since the last look."""
        if self.end_reason:
            return
        nodes = list(self.session.nodes.values())
        for trace, tap in self._rows:
            trace.adapt_qos()
            tap.watch(nodes)

    def _topic_data(self, trace: Trace, tap: CallbackTap, start: int) -> dict[str, Any]:
        passages = trace.passages_since(start)
        found = timeline.compute_figures(passages)
        plots = timeline.compute_plots(passages, start, self._window)
        lanes = [
            self._lane_data("published", [passage.published for passage in passages], start),
            self._lane_data(
                "received", [passage.received for passage in passages], start, found.drops
            ),
        ]
        for node, runs in _by_node(tap.runs_since(start)).items():
            moments = [run.started for run in runs]
            lanes.append(
                self._lane_data(f"callback of {node}", moments, start, timeline.find_drops(runs))
            )
        return {
            "name": trace.topic,
            "text": describe_figures(found) + describe_shortening(trace, tap, start),
            "newest": describe_newest(trace),
            "lanes": lanes,
            "rate": _round_values(plots.rate, 1.0, 2),
            "p50": _round_values(plots.p50, 1e3, 3),
            "p95": _round_values(plots.p95, 1e3, 3),
            "gaps": [
                [self._window_share(begin, start), self._window_share(end, start)]
                for begin, end in found.gaps
            ],
        }

    def _lane_data(
        self, label: str, moments: list[int], start: int, drops: Sequence[tuple[float, int]] = ()
    ) -> dict[str, Any]:
        return {
            "label": label,
            "counts": timeline.count_columns(moments, start, self._window),
            "drops": [
                [self._window_share(when, start), count] for when, count in drops[-MOST_DROPS:]
            ],
        }

    def _window_share(self, moment: float, start: int) -> float:
        """Return where a moment (s) is in the window from ``start`` (ns), 0 to 1."""
        return round((moment - start / 1e9) / (self._window / 1e9), 4)


def _by_node(runs: list[Run]) -> dict[str, list[Run]]:
    """Return the runs of each node's callbacks, in the order in which messages were published."""
    found: dict[str, list[Run]] = {}
    for run in sorted(runs, key=lambda run: (run.node, run.published)):
        found.setdefault(run.node, []).append(run)
    return found


def _round_values(values: list[float | None], unit: float, digits: int) -> list[float | None]:
    return [None if value is None else round(value * unit, digits) for value in values]
