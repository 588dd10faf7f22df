"""Figures of the feel of drilling and burring, by osteon-feel: the reference simulations of the feed rig and of the
hands on virtual time, what changes them and what must not, a burr's forces, and guided drilling. Each group
leaves a picture."""
import json

import numpy as np

# Chi's law (7.3) at 1000 rpm and 1 mm/s in the layers of the block, and the height of the drill's cone.
RIG_N = {"cortical": 28.9, "medullary": 3.25}
CONE_MM = 0.961
DRILL_PITCH_MM = 0.125   # of the level that a drill of 3.2 mm cuts
PLUNGE_MM = {"expert": 6.0, "novice": 14.4}
COUPLING_N_PER_MM = 50.0
# Direction in which a plunge must change when a parameter rises.
DIRECTIONS = {"push_n": 1, "wear": 1, "stiffness_n_per_mm": -1, "damping_n_s_per_mm": -1}


def percent(value, expected):
    return 100.0 * abs(value - expected) / abs(expected)


def ask(run, part):
    run.say(f"feel: {part}")
    return json.loads(run.output("osteon-feel", part, progress=part == "hands"))


def leave(run, part, draw, out):
    import feel_pictures  # uses matplotlib
    picture = run.folder / f"feel-{part}.png"
    getattr(feel_pictures, draw)(out, picture)
    return picture


def rig(run):
    out = ask(run, "rig")
    near, medulla, far = out["force_n"]
    picture = leave(run, "rig", "rig", out)
    run.tables.append((f"feed rig, simulated device; picture: {picture}",
                       [("near N", "medulla N", "far N", "ramp mm", "after the exit N"),
                        (near, medulla, far, out["ramp_mm"], out["after_exit_n"])]))
    return {
        "feel_rig_cortical_error": (max(percent(f, RIG_N["cortical"]) for f in (near, far)), None),
        "feel_rig_medullary_error": (percent(medulla, RIG_N["medullary"]), None),
        "feel_rig_force_ratio": (min(near, far) / medulla, None),
        "feel_rig_ramp_error": (abs(out["ramp_mm"] - CONE_MM) / (0.5 * DRILL_PITCH_MM), None),
        "feel_rig_after_exit": (out["after_exit_n"], None),
    }


def wrong_ways(out):
    """Sweeps in which the plunge changes in the wrong direction somewhere."""
    return [(name, who) for name, sign in DIRECTIONS.items() for who in PLUNGE_MM
            if (sign * np.diff(out[name][who]["plunge_mm"]) <= 0).any()]


def hands(run):
    out = ask(run, "hands")
    picture = leave(run, "hands", "hands", out)
    rows = [("hand", "force N", "feed mm/s", "plunge mm", "reference")]
    for who, reference in PLUNGE_MM.items():
        one = out[who]
        rows.append((who, "/".join(f"{f:.1f}" for f in one["force_n"]),
                     "/".join(f"{v:.2f}" for v in one["feed_mm_per_s"]),
                     f"{one['plunge_mm']:.2f}", reference))
    rows += [(f"{who} over {name}", "", "", " ".join(f"{v:.2f}" for v in out[name][who]["plunge_mm"]),
              " ".join(f"{v:g}" for v in out[name]["values"])) for name in DIRECTIONS for who in PLUNGE_MM]
    run.tables.append((f"hands, simulated device; picture: {picture}", rows))
    # Released stretch of the hand's spring and of the coupling: F / K + F / K_c after the cone's exit.
    closed = {who: out[who]["force_n"][2] * (1 / out[who]["stiffness_n_per_mm"] + 1 / COUPLING_N_PER_MM)
              for who in PLUNGE_MM}
    return {
        **{f"feel_{who}_plunge_error": (percent(out[who]["plunge_mm"], PLUNGE_MM[who]), None) for who in PLUNGE_MM},
        "feel_plunge_closed_form_error": (max(percent(out[who]["after_exit_mm"], closed[who]) for who in PLUNGE_MM),
                                          None),
        "feel_plunge_wrong_ways": (len(wrong_ways(out)), None),
    }


def steps(run):
    """The largest change of any force, feed and plunge compared with 1 kHz and 0.5 mm."""
    out = ask(run, "steps")
    worst = {"tick": 0.0, "pitch": 0.0}
    rows = [("case", "hand", "force N", "feed mm/s", "plunge mm", "after exit mm", "largest change %")]
    base = {r["hand"]: r for r in out if r["case"] == out[0]["case"]}
    for r in out:
        b = base[r["hand"]]
        changes = [percent(x, y) for key in ("force_n", "feed_mm_per_s") for x, y in zip(r[key], b[key])]
        if r["hand"] != "rig":
            changes.append(percent(r["plunge_mm"], b["plunge_mm"]))
        which = "pitch" if r["case"].startswith("1 kHz") else "tick"
        worst[which] = max(worst[which], *changes)
        rows.append((r["case"], r["hand"], "/".join(f"{f:.2f}" for f in r["force_n"]),
                     "/".join(f"{v:.3f}" for v in r["feed_mm_per_s"]), f"{r['plunge_mm']:.2f}",
                     f"{r['after_exit_mm']:.2f}",
                     f"{max(changes):.2f}"))
    run.tables.append(("ticks and pitches, simulated device", rows))
    return {"feel_tick_change": (worst["tick"], None), "feel_pitch_change": (worst["pitch"], None)}


def profiles(run):
    out = ask(run, "profiles")
    pictures = [str(leave(run, kind, "profile", {"kind": kind, **out[kind]})) for kind in ("burring", "milling")]
    values, rows = {}, [("", "mean N", "peak N", "mean |x| N", "mean |y| N", "mean |z| N", "removed mm3")]
    for kind, one in out.items():
        force = {key: np.abs(one[key]) for key in ("total_n", "x_n", "y_n", "z_n")}
        cutting = force["total_n"] > 0.1
        mean = {key: float(f[cutting].mean()) if cutting.any() else None for key, f in force.items()}
        shown = (mean["total_n"], force["total_n"].max(), mean["x_n"], mean["y_n"], mean["z_n"])
        rows.append((kind, *(f"{v:.2f}" for v in shown), one["removed_mm3"]))
        values[f"feel_{kind}_force"] = (mean["total_n"], None, 0.0, float(force["total_n"].max()))
    run.tables.append((f"forces of a round burr on cortical bone, simulated device; pictures: {', '.join(pictures)}",
                       rows))
    return values


def guided(run):
    out = ask(run, "guided")
    picture = leave(run, "guided", "guided", out)
    most = {way: [r["most_of_play"] for r in out["runs"] if r["guided"] is way] for way in (True, False)}
    run.tables.append((f"guided drilling with a trembling hand, simulated device; picture: {picture}",
                       [("hand", "through the sleeve", "cuts off the line", "beyond the play",
                         "tool as a part of the play")] + [
                           (r["hand"], "yes" if r["guided"] else "no", f"{max(r['off_mm']):.3f} mm",
                            f"{r['cut_excess_mm']:.4f} mm", f"{r['most_of_play']:.4f}") for r in out["runs"]]))
    excess = {way: [r["cut_excess_mm"] for r in out["runs"] if r["guided"] is way] for way in (True, False)}
    return {"feel_guided_of_play": (max(most[True]), min(most[False])),
            "feel_guided_excess": (max(excess[True]), min(excess[False]))}


GROUPS = {"feel_rig": rig, "feel_hands": hands, "feel_steps": steps, "feel_profiles": profiles, "feel_guided": guided}
