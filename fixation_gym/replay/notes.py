"""What a user should know about a replay, in sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def notes_on(summary: Mapping[str, Any], from_first: bool) -> list[str]:
    """Sentences on what was left out or is missing.

    Args:
        summary: without its notes.
        from_first: whether the first picture was used.
    """
    counts = {
        "duplicate_times": "left out, since another has the same time",
        "times_out_of_order": "left out, since their times are out of order",
        "without_pose": "left out, since no camera pose is known at their time",
    }
    notes = [f"{_pictures(summary[name])} {what}" for name, what in counts.items() if summary[name]]
    if not from_first:
        notes.append("the first picture was left out, so the target is looked for in the next with a pose")
    if summary["gaps"]:
        notes.append(
            f"{summary['gaps']} gaps between pictures, the longest of {summary['longest_gap_s']:.2f} s: across a gap "
            "there is no map"
        )
    for why, count in summary["without_map"].items():
        notes.append(f"{_pictures(count)} without a map: {why}")
    unseen = summary["perceived"] - summary["seen"]
    if unseen:
        notes.append(f"the target was not seen in {_pictures(unseen)}")
    return notes


def _pictures(count: int) -> str:
    return f"{count} picture" if count == 1 else f"{count} pictures"


def format_summary(summary: Mapping[str, Any]) -> str:
    """The summary for a terminal."""
    lines = [
        f"{summary['perceived']} of {summary['pictures']} pictures, target found by {summary['found_by']}, "
        f"{summary['perception_ms']:.1f} ms of perception per picture"
    ]
    if summary["pictures_resumed"]:
        lines.append(f"{_pictures(summary['pictures_resumed'])} of these by the run before, which was killed")
    distance, map_, mask = (summary[name] for name in ("distance", "map", "mask"))
    if distance is not None and distance["frames"]:
        lines.append(
            f"distance: median |error| {1000 * distance['median_abs_error_m']:.1f} mm "
            f"({100 * distance['median_relative_error']:+.1f} %), |error|/std "
            f"{distance['median_abs_error_over_std']:.1f} in the median, over {distance['frames']} pictures"
        )
    at_once = None if summary["triangulation"] is None else summary["triangulation"]["distance"]
    if distance is not None and at_once is not None and at_once["frames"]:
        lines.append(
            f"one triangulation of all: median |error| {1000 * at_once['median_abs_error_m']:.1f} mm, at the last "
            f"picture {1000 * at_once['last_error_m']:+.1f} mm (picture by picture {_last(distance)})"
        )
    if map_ is not None:
        names = ("sign_right", "precision", "recall", "false_alarms", "clear_cells_alarmed")
        values = (f"{name.replace('_', ' ')} {_ratio(map_[name])}" for name in names)
        lines.append(f"map against depth: {', '.join(values)}, over {map_['frames']} maps")
    if mask is not None:
        lines.append(f"mask: overlap {mask['median_overlap']:.2f} in the median, {mask['least_overlap']:.2f} at least")
    lines += [f"alarm: {alarm}" for alarm in summary["alarms"]]
    return "\n".join([*lines, *(f"note: {note}" for note in summary["notes"])])


def _last(distance: Mapping[str, Any]) -> str:
    return f"{1000 * distance['last_error_m']:+.1f} mm" if distance["frames"] else "unknown"


def _ratio(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.3f}"
