"""The pictures of osteon-feel: force over depth and time, plunges over the parameters, a burr's forces, and a
guide's play."""
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "deploy/session"))

from plots import ACCENT, BONE, STEEL, plt  # noqa: E402  (the sessions' style; found through the path above)

LAYERS_MM = [(0, 5, "cortical"), (5, 25, "medullary"), (25, 30, "cortical")]
COLOURS = {"expert": STEEL, "novice": ACCENT}


def layers(axes):
    for low, high, kind in LAYERS_MM:
        axes.axvspan(low, high, color=BONE, alpha=0.22 if kind == "cortical" else 0.08, lw=0)


def save(figure, file):
    figure.savefig(file, dpi=110)
    plt.close(figure)


def rig(out, file):
    curve = out["curve"]
    figure, (whole, ramp) = plt.subplots(1, 2, figsize=(11, 4), width_ratios=[2, 1], constrained_layout=True)
    layers(whole)
    whole.plot(curve["depth_mm"], curve["force_n"], color=ACCENT, lw=1.0)
    for force in (28.9, 3.25):
        whole.axhline(force, color=STEEL, lw=0.8, ls="--")
    whole.set_xlim(-1, 34)
    whole.set_xlabel("depth of the tip, mm")
    whole.set_ylabel("thrust, N")
    whole.set_title("feed rig, 1 mm/s, 1000 rpm; dashed: Chi's law", fontsize=10, loc="left")
    depth, engaged = np.array(curve["depth_mm"]), np.array(curve["engaged"])
    first = (depth > -0.3) & (depth < 1.6)
    height = np.linspace(0, 0.961, 50)
    ramp.plot(height, (height / 0.961) ** 2, color=STEEL, lw=1.0, ls="--", label="of a cone, (z / 0.961)²")
    ramp.plot(depth[first], engaged[first], color=ACCENT, lw=1.0, label="simulated")
    ramp.set_xlabel("depth of the tip, mm")
    ramp.set_ylabel("engaged share of the point")
    ramp.legend()
    save(figure, file)


def hands(out, file):
    figure = plt.figure(figsize=(12, 7.6), constrained_layout=True)
    top, bottom = figure.subfigures(2, 1)
    depth_axes, force_axes = top.subplots(1, 2)
    for who, colour in COLOURS.items():
        curve = out[who]["curve"]
        time = np.array(curve["time_s"])
        began = time[np.argmax(np.array(curve["engaged"]) > 0)]
        depth_axes.plot(time - began, curve["depth_mm"], color=colour, lw=1.1,
                        label=f"{who}: plunge {out[who]['plunge_mm']:.1f} mm")
        force_axes.plot(curve["depth_mm"], curve["force_n"], color=colour, lw=0.9, label=who)
    for depth in (0, 5, 25, 30):
        depth_axes.axhline(depth, color=BONE, lw=0.8)
    depth_axes.invert_yaxis()
    depth_axes.set_xlabel("time since the first touch, s")
    depth_axes.set_ylabel("depth of the tip, mm")
    depth_axes.legend()
    layers(force_axes)
    force_axes.set_xlabel("depth of the tip, mm")
    force_axes.set_ylabel("thrust, N")
    force_axes.legend()
    names = {"push_n": "push, N", "wear": "wear of the drill (1: sharp)",
             "stiffness_n_per_mm": "stiffness K of the hand, N/mm",
             "damping_n_s_per_mm": "damping B of the hand, N·s/mm"}
    for axes, (name, label) in zip(bottom.subplots(1, 4, sharey=True), names.items()):
        for who, colour in COLOURS.items():
            axes.plot(out[name]["values"], out[name][who]["plunge_mm"], "o-", color=colour, ms=4, lw=1.0, label=who)
        axes.set_xlabel(label)
        axes.set_ylim(bottom=0)
    bottom.axes[0].set_ylabel("plunge, mm")
    bottom.axes[0].legend()
    save(figure, file)


def profile(out, file):
    """Total force and its parts along X, Y and Z over time, as in Figures 7.7 and 7.8 of the dissertation."""
    figure, axes = plt.subplots(4, 1, figsize=(10, 8), sharex=True, constrained_layout=True)
    parts = [("total_n", "(a) total", ACCENT), ("x_n", "(b) X, along the sweep", STEEL),
             ("y_n", "(c) Y, across it", STEEL),
             ("z_n", "(d) Z, into the bone", STEEL)]
    time = np.array(out["time_s"]) - out["time_s"][0]
    for one, (key, label, colour) in zip(axes, parts):
        one.plot(time, out[key], color=colour, lw=0.7)
        one.set_ylabel("force, N")
        one.set_title(label, fontsize=10, loc="left")
    axes[-1].set_xlabel("time, s")
    figure.suptitle(f"{out['kind']} of cortical bone, {out['tool']}, {out['sweep_mm_per_s']:g} mm/s: force of the "
                    "bone on "
                    "the tool", fontsize=11)
    save(figure, file)


def guided(out, file):
    figure, axes = plt.subplots(figsize=(10, 4.4), constrained_layout=True)
    marks = {"rig": "x", "expert": ".", "novice": "+"}
    for one in out["runs"]:
        axes.plot(one["depth_mm"][::3], one["off_mm"][::3], marks[one["hand"]], color=STEEL if one["guided"]
                  else ACCENT, ms=3,
                  mew=0.6, alpha=0.7, label=f"{one['hand']}, {'through the sleeve' if one['guided'] else 'by eye'}")
    depth = np.array([0.0, 30.0])
    play = out["play_mm"] * (1 + 2 * depth / out["sleeve_mm"])
    axes.plot(depth, play, color="black", lw=1.2, ls="--", label="play c (1 + 2 L / L_sleeve)")
    axes.set_xlabel("depth L of the tip, mm")
    axes.set_ylabel("off the planned line, mm")
    axes.set_title("cuts of a hand that strays by up to 1.2 mm", fontsize=10, loc="left")
    axes.set_ylim(0, 1.05)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)
    save(figure, file)
