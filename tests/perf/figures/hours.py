"""Figures of hours at the window: whether its memory, and that of its children, stays where it is after a warm-up."""
import json
from typing import NamedTuple

import numpy as np

from registry import HOURS_OF, Measured

WARM_UP = 1 / 6  # of the time: ten minutes of an hour
PART = 1 / 5     # of what follows: the first and the last part are compared


class Growth(NamedTuple):
    """How a size changed after the warm-up: where a straight line through it begins, and how it rises."""
    begins_mb: float
    mb_per_hour: float
    last_over_first: float  # medians of the last and of the first part

    def percent_per_hour(self):
        return 100.0 * self.mb_per_hour / self.begins_mb


def growth(minutes, sizes_mb):
    """None: too few rounds after the warm-up, or the process was not there in each of them."""
    minutes, sizes = np.asarray(minutes, float), np.asarray(sizes_mb, float)
    if minutes.size == 0:
        return None
    after = minutes >= WARM_UP * minutes[-1]
    minutes, sizes = minutes[after], sizes[after]
    if minutes.size < 4 or not np.all(sizes > 0.0):
        return None
    hours = (minutes - minutes[0]) / 60.0
    slope, begins = np.polyfit(hours, sizes, 1)
    part = max(1, int(PART * sizes.size))
    return Growth(float(begins), float(slope), float(np.median(sizes[-part:]) / np.median(sizes[:part])))


def hours(run, kind):
    minutes = 240 if run.soak else 60
    run.say(f"{minutes} minutes at the window, {kind}")
    # the rounds are shown as they come
    rounds = json.loads(run.output("osteon-window-hours", minutes, kind, progress=True))["rounds"]
    rows, values = [("process", "MB after warm-up", "MB/h", "last over first")], {}
    for program in HOURS_OF:
        found = growth([r["minute"] for r in rounds], [r[program]["rss_mb"] for r in rounds])
        values[f"window_{kind}_{program.removeprefix('osteon-')}"] = Measured(found and found.percent_per_hour())
        if found:
            rows.append((program, f"{found.begins_mb:.1f}", f"{found.mb_per_hour:+.2f}",
                         f"{found.last_over_first:.4f}"))
    last = rounds[-1] if rounds else {"minute": 0.0, "holes": 0, "deep": 0}
    run.tables.append((f"Memory of the window and its children in {last['minute']:.0f} minutes, {kind}: {len(rounds)} "
                       f"rounds, {last['holes']} holes, {last['deep']} of them deep", rows))
    return values


GROUPS = {f"window_{kind}": lambda run, kind=kind: hours(run, kind) for kind in ("rooms", "room")}
