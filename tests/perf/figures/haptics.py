"""Figures of the haptic loop: what its coupling does with energy, what a tick costs, what a silent network does to it. All
with simulated devices and hands."""
import json

from registry import Measured

TICK_BUDGET_US = 60.0


def stability(run):
    """A million ticks on virtual time; the same numbers on every machine."""
    run.say("stability: a million ticks of stroking, pressing and cutting")
    out = json.loads(run.output("osteon-stability", 10_000_000 if run.soak else 1_000_000, progress=True))
    names = ("scene", "delay_ms", "episodes", "touching", "generated_mj", "worst_mj", "net_mj", "cutting_mj", "held_back",
             "returned", "undone")
    run.tables.append((f"stability on a simulated device, {out['ticks']} ticks, {out['touching']} in contact, {out['cutting']} "
                       "cutting", [names] + [tuple(r[n] for n in names) for r in out["runs"]]))
    return {
        "stability_ticks": Measured(out["ticks"]),
        "stability_contacts": Measured(out["episodes"]),
        "stability_undone": Measured(out["undone"]),
        "stability_worst_contact": Measured(out["worst_mj"]),
        "stability_generated": Measured(out["generated_mj"]),
        "stability_net": Measured(out["net_mj"], -out["cutting_mj"]),
        "stability_cutting_power": Measured(out["least_cutting_n_mm"]),
        "stability_step": Measured(max(0.0, out["step_over_n"])),
        "stability_step_still": Measured(out["still_step_n"]),
        "stability_motor_excess": Measured(max(0.0, out["motor_over_n"])),
        "stability_motor_late": Measured(out["motor_late_n"]),
        "stability_motor_largest": Measured(out["motor_most_n"]),
        "stability_thin_wall": Measured(out["thin_wall_deepest_mm"]),
        "stability_allocations": Measured(out["allocations"]),
    }


def tick(run):
    run.say("cost of the haptic loop's tick")
    out = json.loads(run.output("osteon-loop-bench", "tick"))
    values = {}
    for work in ("drill", "burr"):
        p50, p99 = out[f"{work}_cutting_p50_us"], out[f"{work}_cutting_p99_us"]
        values[f"tick_{work}"] = Measured(p50 / TICK_BUDGET_US, None, None, None, 1)
        values[f"tick_{work}_p50"] = Measured(p50, None, None, None, 1)
        values[f"tick_{work}_p99"] = Measured(p99, None, None, None, 1)
    return values


def blackout(run):
    """The middle of three parts without a network. Missed periods come in bursts when the machine stops a virtual one, so
    what decides is whether the difference is beyond what such counts scatter by."""
    run.say("a network blackout of 10 s")
    out = json.loads(run.output("osteon-loop-bench", "blackout", 30 if run.soak else 10))
    rows = [("part", "ticks", "missed", "late us p50", "p99", "p99.9", "max", "work us p50", "p99", "cutting", "held")]
    for part in ("before", "blackout", "after"):
        p = out[part]
        rows.append((part, p["ticks"], p["missed"], f"{p['late_p50_us']:.1f}", f"{p['late_p99_us']:.1f}",
                     f"{p['late_p999_us']:.1f}", f"{p['late_max_us']:.0f}", f"{p['work_p50_us']:.1f}",
                     f"{p['work_p99_us']:.1f}", p["cutting_ticks"], p["held_ticks"]))
    run.tables.append((f"network blackout, real-time {'on' if out['realtime'] else 'refused'}, at most {out['most_unconfirmed']} "
                       "cuts unconfirmed", rows))
    without = 0.5 * (out["before"]["missed"] + out["after"]["missed"])
    missed = out["blackout"]["missed"]
    scatter = (missed + 0.5 * without + 1.0) ** 0.5
    return {
        "blackout_missed": Measured(1e4 * missed / out["blackout"]["ticks"], 1e4 * without / out["blackout"]["ticks"]),
        "blackout_missed_more": Measured((missed - without) / scatter),
        "blackout_late_p99": Measured(out["blackout"]["late_p99_us"], max(out[p]["late_p99_us"] for p in ("before", "after"))),
    }


GROUPS = {"haptic_tick": tick, "haptic_blackout": blackout, "haptic_stability": stability}
