"""Compare a folder of ``evaluate`` with recorded episodes: which ended otherwise, and which are bit for bit the same.

    fixation-gym evaluate --policy servo --scenario ... --seed 954 --episodes 20 --out out/golden
    python tests/golden/compare.py out/golden                      # with tests/golden/servo.csv
    python tests/golden/compare.py out/golden --write FILE.csv     # record

A change of structure leaves every path as it is. A change of behaviour does not: then outcomes are counted, the paired
difference is given with its interval, and the changelog names the change.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import sys
from pathlib import Path

from fixation_gym.evaluation.statistics import mcnemar_p, paired_difference_interval
from fixation_gym.evaluation.trace import read_trace

RECORDED = Path(__file__).with_name("servo.csv")
FIELDS = ("scenario", "seed", "success", "collision", "time_s", "path")


def episodes(folder: Path) -> dict[tuple[str, int], dict[str, str]]:
    """Outcome and hash of the tool's path of every episode in a folder, by scenario and seed."""
    rows = {}
    for line in (folder / "episodes.jsonl").read_text(encoding="utf-8").splitlines():
        episode = json.loads(line)
        key = episode["scenario"], int(episode["seed"])
        trace = read_trace(folder / "traces" / f"{key[0]}-{key[1]}.npz")
        path = hashlib.sha256(trace.tool_m.round(4).tobytes()).hexdigest()[:12]
        values = int(episode["success"]), int(episode["collision"]), f"{episode['time_s']:.2f}", path
        rows[key] = dict(zip(FIELDS, (*key, *values), strict=True))
    return {key: {name: str(value) for name, value in row.items()} for key, row in rows.items()}


def recorded(file: Path) -> dict[tuple[str, int], dict[str, str]]:
    """The same from a CSV."""
    with file.open(encoding="utf-8", newline="") as lines:
        return {(row["scenario"], int(row["seed"])): row for row in csv.DictReader(lines)}


def free(row: dict[str, str]) -> bool:
    """Whether an episode succeeded without a collision."""
    return row["success"] == "1" and row["collision"] == "0"


def main() -> int:
    """Compare or record; returns 1 if outcomes differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--recorded", type=Path, default=RECORDED)
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    if not (options.folder / "episodes.jsonl").is_file():
        parser.error(f"{options.folder} is no folder of evaluate: it has no episodes.jsonl")
    now = episodes(options.folder)
    if options.write is not None:
        with options.write.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(now[key] for key in sorted(now))
        return 0
    before = recorded(options.recorded)
    shared = sorted(set(now) & set(before))
    if not shared:
        parser.error(f"{options.folder} and {options.recorded} share no episode")
    same = sum(now[key]["path"] == before[key]["path"] for key in shared)
    gained = [key for key in shared if free(now[key]) and not free(before[key])]
    lost = [key for key in shared if free(before[key]) and not free(now[key])]
    both = sum(free(now[key]) and free(before[key]) for key in shared)
    neither = len(shared) - both - len(gained) - len(lost)
    low, high = paired_difference_interval(both, len(gained), len(lost), neither)
    print(f"{len(shared)} episodes, {same} with the same path to 0.1 mm")
    print(f"success without collision: {both + len(lost)} before, {both + len(gained)} now")
    change = 100 * (len(gained) - len(lost)) / len(shared)
    p = mcnemar_p(len(gained), len(lost))
    print(f"change {change:+.1f} points [{100 * low:+.1f}, {100 * high:+.1f}], McNemar p = {p:.2g}")
    for name, keys in (("gained", gained), ("lost", lost)):
        print(f"{name}:", ", ".join(f"{scenario}:{seed}" for scenario, seed in keys) or "none")
    return int(bool(gained or lost))


if __name__ == "__main__":
    sys.exit(main())
