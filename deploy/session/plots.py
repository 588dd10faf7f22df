"""Plots of force and sound for a session's report."""
import os
from pathlib import Path

import numpy as np

os.environ.setdefault("MPLBACKEND", "Agg")
import matplotlib  # noqa: E402  (its backend is chosen above)

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

import record  # noqa: E402

BONE, STEEL, ACCENT, INK = "#b08d57", "#4a6fa5", "#c8553d", "#2b2b2b"
plt.rcParams.update({
    "font.size": 10, "axes.edgecolor": "#999999", "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK,
    "ytick.color": INK, "axes.grid": True, "grid.color": "#e6e6e6", "axes.axisbelow": True,
    "axes.spines.top": False, "axes.spines.right": False, "figure.facecolor": "white", "legend.frameon": False,
})


def thinned(table, most=6000):
    """The table, thinned to about `most` rows at most. A plot cannot show more."""
    step = max(1, len(table["time_s"]) // most)
    return {name: values[::step] for name, values in table.items()}


def force_and_depth(session, file: Path):
    """Force, feed and depth over time. Beside it, for each tool, force over depth."""
    stretches = record.stretches(session)
    rows = thinned(session)
    time = rows["time_s"]
    figure = plt.figure(figsize=(12, 7.2), constrained_layout=True)
    left, right = figure.subfigures(1, 2, width_ratios=[2.2, 1])
    force, feed, depth = left.subplots(3, 1, sharex=True, height_ratios=[1.3, 1, 1.2])
    above = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.1, "ncols": 2}

    force.plot(time, rows["force_physical_n"], color=ACCENT, lw=0.9, label="physical: bone on tool")
    force.plot(time, rows["force_rendered_n"], color=STEEL, lw=1.1, label="rendered: device on hand")
    force.set_ylabel("force, N")
    force.legend(**above)
    feed.plot(time, rows["feed_mm_per_s"], color=BONE, lw=0.8)
    feed.set_ylabel("feed, mm/s")
    depth.plot(time, rows["depth_mm"], color=ACCENT, lw=1.0, label="tool")
    depth.plot(time, rows["device_depth_mm"], color=STEEL, lw=0.8, ls="--", label="hand")
    bottom, top = (-5.0, 5.0)
    if stretches:
        bottom, top = -8.0, float(session["depth_mm"].max()) + 4.0
    depth.set_ylim(bottom, top)
    depth.invert_yaxis()
    depth.axhline(0.0, color="#aaaaaa", lw=0.8)
    depth.set_ylabel("depth below the\nbone's surface, mm")
    depth.set_xlabel("time, s")
    depth.legend(**above)
    for tool, first, last in stretches:
        for axes in (force, feed, depth):
            axes.axvspan(session["time_s"][first], session["time_s"][last], color=BONE, alpha=0.12, lw=0)
        feed.annotate(tool, (session["time_s"][first], 1.0), xycoords=("data", "axes fraction"), xytext=(2, 3),
                      textcoords="offset points", fontsize=9)

    shown = stretches[:2]
    for i, (tool, first, last) in enumerate(shown):
        axes = right.add_subplot(len(shown), 1, i + 1)
        axes.plot(session["force_physical_n"][first:last + 1], session["depth_mm"][first:last + 1], ".", ms=1.5,
                  color=ACCENT, alpha=0.6)
        axes.invert_yaxis()
        axes.set_title(f"{tool}: force over depth", fontsize=10, loc="left")
        axes.set_xlabel("physical force, N")
        axes.set_ylabel("depth, mm")
    figure.savefig(file, dpi=110)
    plt.close(figure)


def spectrogram(wav: Path, file: Path):
    """The session's sound: its level over time and its frequencies."""
    rate, samples = record.read_wav(wav)
    figure, (level, spectrum) = plt.subplots(2, 1, figsize=(12, 5), sharex=True, height_ratios=[1, 2.4],
                                             constrained_layout=True)
    block = max(1, rate // 50)
    count = len(samples) // block
    if count > 0:
        rms = np.sqrt(np.mean(samples[:count * block].reshape(count, block) ** 2, axis=1) + 1e-12)
        level.plot(np.arange(count) * block / rate, 20 * np.log10(rms), color=STEEL, lw=0.9)
    level.set_ylabel("level, dB")
    level.set_ylim(-90, 0)
    if len(samples) > 4096:
        with np.errstate(divide="ignore"):
            *_, image = spectrum.specgram(samples + 1e-9, NFFT=4096, Fs=rate, noverlap=2048, cmap="magma")
        top = image.get_clim()[1]
        image.set_clim(top - 90, top)
        figure.colorbar(image, ax=spectrum, label="dB", pad=0.01)
    spectrum.set_ylim(0, 8000)
    spectrum.grid(False)
    spectrum.set_ylabel("frequency, Hz")
    spectrum.set_xlabel("time, s")
    figure.savefig(file, dpi=110)
    plt.close(figure)
    loud = samples[np.abs(samples) > 0]
    return {"seconds": round(len(samples) / rate, 2), "samples_per_second": rate,
            "rms": round(float(np.sqrt(np.mean(samples ** 2))), 5) if len(samples) else 0.0,
            "silent": len(loud) == 0}
