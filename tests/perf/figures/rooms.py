"""Figures of a room that loses nothing: simulated rooms, journals on failing disks, killed servers, bad networks,
forged datagrams and many observers. All hands are simulated. Networks are simulated, or impaired on this machine."""
import json
import os

import numpy as np

from registry import Measured

BREAKAGES = ("dedup", "ordering", "skipping", "replica", "forgetful", "pruning")
PROTOCOL_SEED_MS = 50.0
CONVERGED_S = 2.0
FELT_LOOPBACK_MS, FELT_BAD_MS = 25.0, 150.0
FELT_STAGES = ("uplink", "wait_for_tick", "decide", "commit", "downlink", "replica_and_patch")
OBSERVERS_MS, OBSERVERS_HZ = 40.0, 30.0
TWO_TICKS_MS = 2000.0 / 120


def simulate(run, *arguments, may_fail=False):
    out, _ = run.outcome("osteon-simulate", *arguments) if may_fail else (run.output("osteon-simulate", *arguments), 0)
    return json.loads(out)


def simulated(run):
    last = 100_000 if run.soak else 10_000
    run.say(f"{last} rooms simulated")
    out = simulate(run, "--seeds", f"1..{last}", may_fail=True)
    run.tables.append(("Simulated rooms, small", list(out.items())))
    cpu = out["cpu_ms"]
    return {
        "simulated_seeds": (out["seeds"], None),
        "simulated_failures": (out["failures"], None),
        "simulated_acknowledged": (out["acknowledged"], None),
        "simulated_crashes": (out["crashes"], None),
        "simulated_decisions": (out["decisions"], None),
        "simulated_forbidden": (out["forbidden"], None),
        "simulated_cpu": (cpu["p50"] / PROTOCOL_SEED_MS, None),
    }


def simulated_full(run):
    run.say("300 larger rooms simulated")
    out = simulate(run, "--full", "--seeds", "1..300", may_fail=True)
    run.tables.append(("Simulated rooms, full", list(out.items())))
    return {
        "simulated_full_seeds": (out["seeds"], None),
        "simulated_full_failures": (out["failures"], None),
        "simulated_full_settled": (out["settled_s"]["max"] / CONVERGED_S, None),
    }


def simulated_broken(run):
    run.say("rooms simulated with something broken")
    failures = {}
    for what in BREAKAGES:
        failures[what] = simulate(run, "--seeds", "1..300", "--break", what, may_fail=True)["failures"]
    run.tables.append(("Seeds of 300 that fail with something broken", list(failures.items())))
    return {
        "simulated_breakages_missed": (sum(count == 0 for count in failures.values()), None),
        "simulated_breakage_least": (min(failures.values()), None),
    }


def journal(run):
    seeds, operations, damages = (20_000, 1000, 100_000) if run.soak else (2000, 1000, 10_000)
    run.say("journals on failing disks")
    out = json.loads(run.output("osteon-journal-trials", seeds, operations, damages))
    run.tables.append(("Journals on a disk that forgets", [(name, json.dumps(tally)) for name, tally in out.items()]))
    durable = [out[name] for name in ("power_loss", "full_disk", "failing_disk", "forgotten_sync")]
    killed = [out[name] for name in ("kills", "power_failures")]
    return {
        "journal_trials": (sum(tally["trials"] for tally in durable), None),
        "journal_acknowledged": (sum(tally["acknowledged"] for tally in durable), None),
        "journal_lost": (sum(tally["lost"] for tally in durable), None),
        "journal_bad_trials": (sum(tally["bad_trials"] for tally in durable), None),
        "journal_not_durable_lost": (out["not_durable"]["lost"], None),
        "journal_damage_trials": (out["damage"]["trials"], None),
        "journal_damage_silent": (out["damage"]["silent"], None),
        "journal_damage_only_log_silent": (out["damage_only_log"]["silent"], None),
        "journal_kill_trials": (sum(tally["trials"] for tally in killed), None),
        "journal_false_alarms": (sum(tally["called_damaged"] + tally["silent"] for tally in killed), None),
    }


def journal_commits(run):
    """In turns with an earlier osteon-journal-commits, if OSTEON_EARLIER_JOURNAL names one."""
    earlier = os.environ.get("OSTEON_EARLIER_JOURNAL")
    if not earlier:
        run.skip("journal_commit", "OSTEON_EARLIER_JOURNAL names no earlier program")
    programs = {"now": "osteon-journal-commits"} | ({"before": earlier} if earlier else {})
    values, rows = {}, []
    for per_commit in (1, 4):
        run.say(f"commits of {per_commit} entries")
        found = {which: [] for which in programs}
        for turn in range(15 if run.soak else 7):
            for which, program in programs.items():
                file = run.folder / f"commits-{which}-{per_commit}-{turn}"
                found[which].append(json.loads(run.output(program, file, 8000, per_commit)))
        middle = {which: {key: float(np.median([out[key] for out in outs])) for key in outs[0]}
                  for which, outs in found.items()}
        rows += [(f"{which}, {per_commit} a commit", json.dumps(keys)) for which, keys in middle.items()]
        for name, key in (("p50", "p50_us"), ("p99", "p99_us"), ("bytes", "with_close")):
            now, before = middle["now"][key], middle.get("before", {}).get(key)
            values[f"journal_commit_{name}_{per_commit}"] = (now / before if before else None, None)
    run.tables.append(("Commits of entries of 150 bytes", rows))
    return values


def server_kills(run):
    # In rooms of 500 kills each, because a room opens later as its journal grows.
    rooms = 20 if run.soak else 4
    run.say(f"{500 * rooms} killed servers")
    outs = [json.loads(run.output("osteon-server-kills", 500, 2 + room)) for room in range(rooms)]
    run.tables.append(("Killed servers, rooms of 500 kills",
                       [(name, *(out[name] for out in outs)) for name in outs[0]]))
    total = {name: sum(out[name] for out in outs) for name in outs[0] if isinstance(outs[0][name], int)}
    return {
        "server_kills": (total["kills"], None),
        "server_kills_acknowledged": (total["acknowledged"], None),
        "server_kills_lost": (total["lost"] + total["twice"] + total["missing"] + total["hashes_that_differ"], None),
        "server_kills_back": (max(out["back_p50_ms"] for out in outs), None),
    }


def bad_network(run):
    run.say("real processes on bad networks")
    out = json.loads(run.output("osteon-bad-network", 50))
    run.tables.append(("Bad networks", [(name, json.dumps(kind)) for name, kind in out.items()]))
    good, bad = out["loopback"], out["bad"]

    # Of all cuts of all runs together. Also measures the machine's own delay of waiting, waking and syncing.
    def felt(kind, bound_ms):
        of = kind["felt_ms"]
        return Measured(of["p99_pooled"] / bound_ms, kind["machine_ms"]["p99"] / bound_ms,
                        low=of["p99_median_run"] / bound_ms,
                        high=of["p99_worst_run"] / bound_ms)

    return {
        "bad_network_runs": (bad["runs"], None),
        "bad_network_faults": (bad["faults"] + good["faults"] + bad["sent"] - bad["kept"], None),
        "bad_network_converged": (bad["converged_s"]["max"] / CONVERGED_S, None),
        "felt_loopback_p99": felt(good, FELT_LOOPBACK_MS),
        "felt_bad_p99": felt(bad, FELT_BAD_MS),
    }


def felt_stages(run):
    run.say("stages of a felt cut")
    out = json.loads(run.output("osteon-felt-stages", 30 if run.soak else 10))
    good, bad = out["loopback"], out["bad"]
    rows = [("stage, ms", "loopback p50", "p99", "bad network p50", "p99")]
    rows.append(("close the cut", "at most", f"{good['cut_closes_after_ms']['most']}", "at most",
                 f"{bad['cut_closes_after_ms']['most']}"))
    for stage, of_good, of_bad in [(stage, good["stages"][stage], bad["stages"][stage]) for stage in FELT_STAGES] + [
            ("sent to felt", good["whole"], bad["whole"])]:
        rows.append((stage.replace("_", " "), of_good["p50"], of_good["p99"], of_bad["p50"], of_bad["p99"]))
    for name, key in (("lateness of ticks", "tick_late_ms"), ("transactions", "transaction_ms")):
        rows.append((name, good[key]["p50"], good[key]["p99"], bad[key]["p50"], bad[key]["p99"]))
    run.tables.append(("Stages of a felt cut; hands and the bad network are simulated", rows))
    values = {f"felt_stage_{stage}": (good["stages"][stage]["p50"], bad["stages"][stage]["p50"])
              for stage in FELT_STAGES}
    values["felt_stage_close"] = (good["cut_closes_after_ms"]["most"], bad["cut_closes_after_ms"]["most"])
    values["felt_stage_all"] = (good["whole"]["p50"], bad["whole"]["p50"])
    return values


def uplink(run):
    run.say("what one tool sends and keeps")
    out = json.loads(run.output("osteon-uplink", 60 if run.soak else 20))
    rows = [("line and work", "kbit/s", "datagrams", "stream", "busiest second")]
    for name, kind in out.items():
        for work in ("cutting", "idle"):
            rate = kind[work]
            rows.append((f"{name}, {work}", rate["kbit_per_s"], rate["of_them_datagrams"], rate["of_them_stream"],
                         rate["busiest_second"]))
    run.tables.append(("Uplink of a simulated hand's tool, headers and acknowledgements included", rows))
    clean, bad = out["clean"], out["bad"]
    kept = clean["journal_bytes"]
    hour = 3600.0 * (kept["database"]["at_last"] - kept["database"]["at_first"]) / clean["cutting_s"]
    run.tables.append(("Journal of that tool", [
        ("entries, MB in an hour of cutting", f"{1e-6 * hour:.1f}"),
        ("a checkpoint, at a clean end, MB", f"{1e-6 * kept['checkpoints']['at_last']:.2f}"),
        ("log beside it, used again and again, at most, MB", f"{1e-6 * kept['log_most']:.2f}")]))
    return {
        "uplink_cutting": (clean["cutting"]["kbit_per_s"], None),
        "uplink_cutting_loss": (bad["cutting"]["kbit_per_s"], clean["cutting"]["kbit_per_s"]),
        "uplink_idle_share": (max(kind["idle"]["kbit_per_s"] / kind["cutting"]["kbit_per_s"] for kind in (clean, bad)),
                              None),
        "journal_mb_per_hour": (1e-6 * (hour + kept["checkpoints"]["at_last"]), None),
    }


# A room that misses more ticks than this is one too many.
MOST_MISSED = 0.05


def rooms_per_core(run):
    run.say("rooms in one process")
    out = json.loads(run.output("osteon-rooms-per-core", 30 if run.soak else 10))
    rows = [("rooms", "cores", "rooms per core", "ticks missed", "late p99 ms", "transaction p99 ms", "behind s")]
    for kind in [*out["cutting"], out["not_kept"], out["idle"]]:
        worst = kind["worst_room_ms"]
        rows.append((kind["rooms"], kind["cores"], kind["rooms_per_core"], kind["tick_missed_share"],
                     worst["tick_late_p99"],
                     worst["commit_p99"], kind["behind_at_the_end_s"]))
    run.tables.append(("Rooms in one process, a simulated tool in each; the last two without journals, and without "
                       "work", rows))
    held = [kind for kind in out["cutting"] if kind["tick_missed_share"] <= MOST_MISSED] or out["cutting"][:1]
    return {"rooms_per_core": (held[-1]["rooms_per_core"], out["not_kept"]["rooms_per_core"])}


def forgery(run):
    count = 10_000_000
    run.say(f"{count} forged datagrams")
    out = json.loads(run.output("osteon-forgery", count))
    run.tables.append(("Forged datagrams", list(out.items())))
    return {
        "forged": (out["forged"], None),
        "forged_accepted": (out["accepted"], None),
        "forged_answered": (out["answered_bytes"], None),
        "genuine_lost": (out["genuine"] - out["genuine_accepted"], None),
    }


def observers(run):
    run.say("150 observers")
    out = json.loads(run.output("osteon-observers"))
    run.tables.append(("Observers", [(name, json.dumps(part)) for name, part in out.items()]))
    everyone, stalled, few = out["all"], out["stalled"], out["few"]
    p99 = everyone["commit_to_mesh_ms"]["p99"]
    return {
        "observers_p99": (p99 / OBSERVERS_MS, few["commit_to_mesh_ms"]["p99"] / OBSERVERS_MS),
        "observers_stalled_p99": (stalled["commit_to_mesh_ms"]["p99"] / OBSERVERS_MS, None),
        "observers_stalled_effect": (stalled["commit_to_mesh_ms"]["p99"] / p99, None),
        "observers_rate": (everyone["mesh"]["per_s_min"] / OBSERVERS_HZ, None),
        "observers_there": (sum(bool(part["everyone_there"]) for part in (everyone, stalled, few)), None),
        "observers_memory": (stalled["server_mb"]["after"] / everyone["server_mb"]["after"], None),
    }


def override(run):
    run.say("how soon and how gently an instructor's word takes hold")
    out = json.loads(run.output("osteon-override", 100 if run.soak else 40))
    rows = [("one way ms", "loss", "stopped", "p50 ms", "p99 ms", "most ms", "from asking p50 ms", "p99 ms",
             "cuts refused")]
    for line in out["lines"]:
        after, asked = line["after_answer"], line["after_asking"]
        rows.append((line["one_way_ms"], line["loss"], f"{line['stopped']} of {line['asked']}", after["p50"],
                     after["p99"],
                     after["max"], asked["p50"], asked["p99"], line["cuts_stopped"]))
    run.tables.append(("From an instructor's word until the hand cuts no more, less the way; hand and line are "
                       "simulated", rows))
    touch = out["touch"]
    felt = ("mount", "one_way_ms", "step_over_slew", "contact_mj", "led_mj", "made_mj", "carried_mm", "touching_s",
            "cutting_s")
    held = tuple(touch[0]["in_contact"])
    run.tables.append(("What hands feel of it, and how often each took hold of a tool on bone",
                       [felt + held] + [tuple(t[n] for n in felt) + tuple(t["in_contact"][n] for n in held)
                                        for t in touch]))
    yielding = [t for t in touch if t["mount"]]
    whole = [line for line in out["lines"] if line["loss"] == 0]
    lossy = [line for line in out["lines"] if line["loss"] > 0]

    def worst(lines, what):
        return max(line["after_answer"][what] for line in lines)

    missing = sum(line["asked"] - line["stopped"] for line in out["lines"])
    return {
        "freeze_p99": (worst(whole, "p99") / TWO_TICKS_MS, worst(whole, "p50") / TWO_TICKS_MS),
        "freeze_p99_loss": (worst(lossy, "p99") / TWO_TICKS_MS, worst(lossy, "p50") / TWO_TICKS_MS),
        "freeze_missing": (missing, None),
        "override_force_step": (max(t["step_over_slew"] for t in touch), max(t["step_over_slew"] for t in yielding)),
        "override_energy": (max(max(t["contact_mj"], t["led_mj"]) / t["budget_mj"] for t in touch),
                            max(max(t["contact_mj"], t["led_mj"]) / t["budget_mj"] for t in yielding)),
        "override_mount_made": (max(t["made_mj"] / t["allowance_mj"] for t in yielding), None),
        "override_mount_carried": (min(t["carried_mm"] for t in yielding), None),
        "override_in_contact": (min(min(t["in_contact"].values()) for t in touch), None),
    }


GROUPS = {"override": override,
          "simulated": simulated, "simulated_full": simulated_full, "simulated_broken": simulated_broken,
          "journal": journal,
          "journal_commits": journal_commits,
          "server_kills": server_kills, "bad_network": bad_network, "felt_stages": felt_stages, "uplink": uplink,
          "rooms_per_core": rooms_per_core, "forgery": forgery, "observers": observers}
