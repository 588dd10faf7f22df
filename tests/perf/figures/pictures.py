"""The pictures that deploy/figures leaves beside its numbers."""
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "deploy/session"))

from plots import ACCENT, BONE, STEEL, plt  # noqa: E402  (the sessions' style; found through the path above)


def growth(out, bytes_per_mm2, file):
    """Cost of a cut over the bone's size; memory over what was cut."""
    figure, (cost, memory) = plt.subplots(1, 2, figsize=(11, 4.2), constrained_layout=True)
    sizes = [s["samples"] for s in out["sizes"]]
    cost.plot(sizes, [s["us_p50"] for s in out["sizes"]], "o-", color=ACCENT, label="median")
    cost.plot(sizes, [s["us_p99"] for s in out["sizes"]], "o--", color=STEEL, label="99th percentile")
    cost.set_xscale("log", base=2)
    cost.set_xticks(sizes, [f"{n}³" for n in sizes])
    cost.set_ylim(bottom=0)
    cost.set_xlabel("samples of the bone")
    cost.set_ylabel("one cut, µs")
    cost.legend()
    area = np.array([m["area_mm2"] for m in out["memory"]])
    memory.plot(area, [m["bytes"] / 1e6 for m in out["memory"]], ".", color=BONE, label="measured")
    memory.plot(area, bytes_per_mm2 * area / 1e6, color=STEEL, lw=1, label=f"{bytes_per_mm2 / 1e3:.1f} kB/mm²")
    memory.set_xlabel("surface cut, mm²")
    memory.set_ylabel("memory of the cut field, MB")
    memory.legend()
    figure.savefig(file, dpi=110)
    plt.close(figure)
