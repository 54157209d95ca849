"""What a picture shows, in words: for a terminal, and for who does not see it."""

from __future__ import annotations

from collections.abc import Sequence

from autograder.examination.pictures.picture import Lane, Picture, Series, Timeline

MOST_TIMES = 4
"""Times that are told one by one; of more, from when to when they are."""
MOST_POINTS = 6


def describe_picture(picture: Picture) -> str:
    """Return what a picture shows, in a sentence for each of its rows.

    Example:
        >>> from autograder.examination.pictures.picture import Series
        >>> threads = Series("Threads", "lives", "threads", ((0, 9), (3, 12)))
        >>> describe_picture(threads)
        'Threads. threads over lives: 9 at 0, 12 at 3.'
    """
    return _series_words(picture) if isinstance(picture, Series) else _timeline_words(picture)


def _series_words(series: Series) -> str:
    points, step = series.points, max(1, len(series.points) // (MOST_POINTS - 1))
    shown = [*points[:-1:step][: MOST_POINTS - 1], points[-1]]
    values = ", ".join(f"{y:g} at {x:g}" for x, y in shown)
    return f"{series.title}. {series.y_label} over {series.x_label}: {values}."


def _timeline_words(timeline: Timeline) -> str:
    decimals = decimals_for(timeline.seconds)
    legend = dict(timeline.legend)
    rows = [_lane_words(lane, legend, decimals) for lane in timeline.lanes]
    return " ".join([f"{timeline.title}.", *rows])


def _lane_words(lane: Lane, legend: dict[str, str], decimals: int) -> str:
    parts = []
    for kind in dict.fromkeys(kind for _, kind in lane.marks):
        times = [at for at, found in lane.marks if found == kind]
        number = f"{len(times)} ({_times_words(times, decimals)})"
        parts.append(_with_meaning(legend, kind, number))
    for stretch in dict.fromkeys(span[2] for span in lane.spans):
        stretches = [
            f"{begin:.{decimals}f} to {end:.{decimals}f} s"
            for begin, end, found in lane.spans if found == stretch
        ]  # fmt: skip
        parts.append(_with_meaning(legend, stretch, ", ".join(_shorten(stretches))))
    return f"{lane.label}: {'; '.join(parts) or 'nothing'}."


def _with_meaning(legend: dict[str, str], kind: str, found: str) -> str:
    return f"{legend[kind]}: {found}" if kind in legend else found


def _shorten(stretches: list[str]) -> list[str]:
    more = len(stretches) - MOST_TIMES
    return [*stretches[:MOST_TIMES], f"and {more} more"] if more > 0 else stretches


def _times_words(times: Sequence[float], decimals: int) -> str:
    if len(times) > MOST_TIMES:
        return f"{times[0]:.{decimals}f} to {times[-1]:.{decimals}f} s"
    return f"{', '.join(f'{at:.{decimals}f}' for at in times)} s"


def decimals_for(seconds: float) -> int:
    """Return with how many decimals times are told of so many seconds."""
    return 1 if seconds >= 2 else 2 if seconds >= 0.2 else 3
