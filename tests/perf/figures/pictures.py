"""The pictures that deploy/figures leaves beside its numbers."""
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "deploy/session"))

from plots import ACCENT, STEEL, plt  # noqa: E402  (the sessions' style; found through the path above)


def growth(out, burs, file):
    """Cost of a cut over the bone's size. Memory that each groove added, over its volume and over its area."""
    figure, (cost, by_volume, by_area) = plt.subplots(1, 3, figsize=(15, 4.2), constrained_layout=True)
    sizes = [s["samples"] for s in out["sizes"]]
    cost.plot(sizes, [s["us_p50"] for s in out["sizes"]], "o-", color=ACCENT, label="median")
    cost.plot(sizes, [s["us_p99"] for s in out["sizes"]], "o--", color=STEEL, label="99th percentile")
    cost.set_xscale("log", base=2)
    cost.set_xticks(sizes, [f"{n}³" for n in sizes])
    cost.set_ylim(bottom=0)
    cost.set_xlabel("samples of the bone")
    cost.set_ylabel("one cut, µs")
    cost.legend()
    for memory, key, what, unit in ((by_volume, "volume", "bone removed by a groove", "mm³"),
                                    (by_area, "area", "surface cut by a groove", "mm²")):
        for bur, colour in zip(burs, (ACCENT, STEEL)):
            slope = bur[f"per_{key}"]
            memory.plot(bur[key], bur["bytes"] / 1e6, ".", color=colour,
                        label=f"{bur['tool']}, {slope / 1e3:.1f} kB/{unit}")
            ends = np.array([0.0, bur[key].max()])
            memory.plot(ends, slope * ends / 1e6, color=colour, lw=1)
        memory.set_xlim(left=0)
        memory.set_ylim(bottom=0)
        memory.set_xlabel(f"{what}, {unit}")
        memory.set_ylabel("memory it added to the cut field, MB")
        memory.legend()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def burred_bone(vertices, pitch_mm, file, width=1000):
    """A bone from the front, drawn by its mesh's vertices. Each is as large as a voxel, and the nearest is on top.
    Cut faces are red."""
    rows = np.fromfile(vertices, dtype=np.float32).reshape(-1, 7)
    x, depth, y = rows[:, 0], rows[:, 1], rows[:, 2]
    scale = max(np.ptp(x), np.ptp(y)) / (width - 40)
    column, line = ((x - x.min()) / scale + 20).astype(int), ((y.max() - y) / scale + 20).astype(int)
    light = np.array([-0.4, -0.75, 0.53], np.float32)
    shade = np.clip(0.25 + 0.75 * np.clip(rows[:, 3:6] @ light, 0, 1), 0, 1)
    colour = np.where(rows[:, 6:] > 0.5, np.array([200, 85, 61]), np.array([236, 220, 190])) * shade[:, None]
    image = np.full((line.max() + 21, column.max() + 21, 3), 255, np.uint8)
    order = np.argsort(-depth)  # the patient's front is at small y, so it is painted last
    order = order[rows[order, 4] < 0.2]
    half = max(1, int(np.ceil(0.6 * pitch_mm / scale)))
    nearest = np.full(image.shape[:2], np.inf, np.float32)
    for down in range(-half, half + 1):
        for right in range(-half, half + 1):
            at = line[order] + down, column[order] + right
            inside = (at[0] >= 0) & (at[0] < image.shape[0]) & (at[1] >= 0) & (at[1] < image.shape[1])
            at, which = (at[0][inside], at[1][inside]), order[inside]
            layer = np.full(image.shape[:2], -1)
            layer[at] = which
            seen = layer >= 0
            closer = seen & (np.where(seen, depth[layer], np.inf) < nearest)
            nearest[closer] = depth[layer[closer]]
            image[closer] = colour[layer[closer]]
    plt.imsave(file, image)
