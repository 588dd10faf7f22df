"""Figures of the haptic loop: the energy of its coupling, the cost of a tick, and the effect of a silent network and of
a live C-arm. All devices and hands are simulated."""
import json

import numpy as np

from registry import Measured

TICK_BUDGET_US = 60.0
PERIOD_US = 1000.0


def stability(run):
    """A million ticks on virtual time, and a million with torque and turns. The same numbers on every machine."""
    run.say("stability: two million ticks of stroking, pressing and cutting")
    out = json.loads(run.output("osteon-stability", 10_000_000 if run.soak else 1_000_000, progress=True))
    names = ("axes", "scene", "delay_ms", "episodes", "touching", "generated_mj", "worst_mj", "net_mj", "cutting_mj",
             "turned_mj",
             "held_back", "returned", "undone")
    three, six = out["three_axes"], out["six_axes"]
    for axes, all_ in ((3, three), (6, six)):
        run.tables.append((f"stability on a simulated device of {axes} axes, {all_['ticks']} ticks, "
                           f"{all_['touching']} in contact, {all_['cutting']} cutting",
                           [names] + [tuple(r[n] for n in names) for r in out["runs"] if r["axes"] == axes]))
    values = {}
    for prefix, all_ in (("stability", three), ("stability_six", six)):
        values |= {
            f"{prefix}_ticks": Measured(all_["ticks"]),
            f"{prefix}_contacts": Measured(all_["episodes"]),
            f"{prefix}_undone": Measured(all_["undone"]),
            f"{prefix}_worst_contact": Measured(all_["worst_mj"]),
            f"{prefix}_generated": Measured(all_["generated_mj"]),
            f"{prefix}_net": Measured(all_["net_mj"], -all_["cutting_mj"]),
            f"{prefix}_cutting_power": Measured(all_["least_cutting_n_mm"]),
            f"{prefix}_pushed_back": Measured(100.0 * all_["pushed_back"] / all_["cutting"]),
            f"{prefix}_pushed_back_most": Measured(all_["pushed_back_most_mj"]),
            f"{prefix}_step": Measured(max(0.0, all_["step_over_n"])),
            f"{prefix}_step_still": Measured(all_["still_step_n"]),
            f"{prefix}_fall": Measured(max(0.0, all_["fall_n"])),
            f"{prefix}_late": Measured(all_["late"]),
            f"{prefix}_motor_excess": Measured(max(0.0, all_["motor_over_n"])),
            f"{prefix}_motor_late": Measured(all_["motor_late_n"]),
            f"{prefix}_motor_largest": Measured(all_["motor_most_n"]),
            f"{prefix}_thin_wall": Measured(all_["thin_wall_deepest_mm"]),
            f"{prefix}_allocations": Measured(all_["allocations"]),
        }
    return values | {
        "stability_six_turned": Measured(six["turned_mj"]),
        "stability_six_torque_step": Measured(max(0.0, six["turn_step_over_n"], six["cut_step_over_n"])),
        "stability_six_torque_excess": Measured(max(0.0, six["torque_over_nmm"], six["cut_over_nmm"])),
        "stability_six_torque_late": Measured(six["cut_late_nmm"]),
        "stability_six_torque_largest": Measured(six["torque_most_nmm"]),
    }


def tick(run):
    run.say("cost of the haptic loop's tick")
    out = json.loads(run.output("osteon-loop-bench", "tick"))
    values = {}
    for work in ("drill", "burr", "pin", "saw", "saw_narrow", "pin_wedged", "saw_wedged"):
        ticks = work if work.endswith("_wedged") else f"{work}_cutting"
        p50, p99 = out[f"{ticks}_p50_us"], out[f"{ticks}_p99_us"]
        values[f"tick_{work}"] = Measured(p50 / TICK_BUDGET_US, None, None, None, 1)
        values[f"tick_{work}_p50"] = Measured(p50, None, None, None, 1)
        values[f"tick_{work}_p99"] = Measured(p99, None, None, None, 1)
        if work.endswith("_wedged"):
            values[f"tick_{work}_late"] = Measured(p99 / PERIOD_US, None, None, None, 1)
    return values


def blackout(run):
    """The middle of three parts is without a network. Missed periods come in bursts when the host suspends a virtual
    machine. So the test is whether the difference exceeds the scatter of such counts."""
    run.say("a network blackout of 10 s")
    out = json.loads(run.output("osteon-loop-bench", "blackout", 30 if run.soak else 10))
    rows = [("part", "ticks", "missed", "late us p50", "p99", "p99.9", "max", "work us p50", "p99", "cutting", "held")]
    for part in ("before", "blackout", "after"):
        p = out[part]
        rows.append((part, p["ticks"], p["missed"], f"{p['late_p50_us']:.1f}", f"{p['late_p99_us']:.1f}",
                     f"{p['late_p999_us']:.1f}", f"{p['late_max_us']:.0f}", f"{p['work_p50_us']:.1f}",
                     f"{p['work_p99_us']:.1f}", p["cutting_ticks"], p["held_ticks"]))
    run.tables.append((f"network blackout, real-time {'on' if out['realtime'] else 'refused'}, at most "
                       f"{out['most_unconfirmed']} "
                       "cuts unconfirmed", rows))
    without = 0.5 * (out["before"]["missed"] + out["after"]["missed"])
    missed = out["blackout"]["missed"]
    scatter = (missed + 0.5 * without + 1.0) ** 0.5
    return {
        "blackout_missed": Measured(1e4 * missed / out["blackout"]["ticks"], 1e4 * without / out["blackout"]["ticks"]),
        "blackout_missed_more": Measured((missed - without) / scatter),
        "blackout_late_p99": Measured(out["blackout"]["late_p99_us"],
                                      max(out[p]["late_p99_us"] for p in ("before", "after"))),
    }


def c_arm(run):
    """Simulated operators drill one hole each, every second one beside a C-arm that is live. Missed ticks come in
    bursts when the host suspends a virtual machine, so their scatter is taken from the pairs if that is larger than
    the scatter of counts."""
    pairs = 16 if run.soak else 8
    run.say(f"{2 * pairs} holes, half of them with a live C-arm")
    runs = json.loads(run.output("osteon-c-arm-ticks", pairs, progress=True))["runs"]
    run.tables.append((
        f"haptic loop beside a window, real-time {'on' if all(r['realtime'] for r in runs) else 'refused'}",
        [("C-arm", "shots", "ticks", "missed", "late us p50", "p99", "p99.9", "max", "work us p50", "p99")] +
        [("live" if r["live"] else "hidden", r["shots"], r["ticks"], r["missed"], f"{r['late_p50_us']:.1f}",
          f"{r['late_p99_us']:.1f}", f"{r['late_p999_us']:.1f}", f"{r['late_max_us']:.0f}", f"{r['work_p50_us']:.1f}",
          f"{r['work_p99_us']:.1f}") for r in runs]))
    live, hidden = ([r for r in runs if r["live"] == which] for which in (True, False))

    def rates(of):
        return np.array([1e4 * r["missed"] / r["ticks"] for r in of])

    def sums(of, what):
        return sum(r[what] for r in of)
    # Neighbours in time make a pair. In counts of the hidden ones' ticks.
    ticks = sums(hidden, "ticks")
    with_it = sums(live, "missed") * ticks / sums(live, "ticks")
    without = sums(hidden, "missed")
    apart = 1e-4 * ticks / pairs * (rates(live) - rates(hidden))
    scatter = max((with_it + without + 1.0) ** 0.5, float(np.std(apart, ddof=1)) * pairs ** 0.5)
    return {
        "c_arm_missed": Measured(1e4 * with_it / ticks, 1e4 * without / ticks, float(min(rates(live))),
                                 float(max(rates(live)))),
        "c_arm_missed_more": Measured((with_it - without) / scatter),
        "c_arm_shots": Measured(sums(live, "shots")),
        "c_arm_late_p99": Measured(float(np.median([r["late_p99_us"] for r in live])),
                                   float(np.median([r["late_p99_us"] for r in hidden]))),
    }


def mount(run):
    """Two users on one bone, a million ticks over each connection. The same numbers on every machine."""
    run.say("mount: two users push a bone against each other, a million ticks over each of four lines")
    out = json.loads(run.output("osteon-mount", 10_000_000 if run.soak else 1_000_000, progress=True))
    names = ("kind", "line_ms", "rests", "worst_percent", "mean_percent", "made_mj", "force_n", "growth", "held_back",
             "put_in_mj", "released_mj", "low_pass_s")
    run.tables.append(("two users on a bone on its mount", [names] + [tuple(r[n] for n in names) for r in out["runs"]]))
    controlled = [r for r in out["runs"] if r["kind"] != "uncontrolled"]
    values = {
        "mount_ticks": Measured(min(r["ticks"] for r in controlled)),
        "mount_made_of_allowance": Measured(max(r["made_mj"] / r["allowance_mj"] for r in controlled)),
        "mount_account": Measured(max(r["account_mj"] for r in controlled)),
        "mount_growth": Measured(max(r["growth"] for r in controlled)),
        "mount_uncontrolled": Measured(max(r["made_mj"] for r in out["runs"] if r["kind"] == "uncontrolled"),
                                       max(r["made_mj"] for r in controlled)),
    }
    for r in controlled:
        if r["kind"] == "push":
            values[f"mount_rest_error_{r['line_ms']}ms"] = Measured(r["worst_percent"], r["mean_percent"])
            values[f"mount_rests_{r['line_ms']}ms"] = Measured(r["rests"])
    return values


GROUPS = {"haptic_tick": tick, "haptic_blackout": blackout, "haptic_c_arm": c_arm, "haptic_stability": stability,
          "haptic_mount": mount}
