"""Figures of a room that loses nothing: simulated rooms, journals on failing disks, killed servers, bad networks, forgers and
many observers. All hands are simulated; networks are simulated, or impaired on this machine."""
import json

from registry import Measured

BREAKAGES = ("dedup", "ordering", "skipping", "replica", "forgetful")
PROTOCOL_SEED_MS = 50.0
CONVERGED_S = 2.0
FELT_LOOPBACK_MS, FELT_BAD_MS = 25.0, 150.0
OBSERVERS_MS, OBSERVERS_HZ = 40.0, 30.0


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
        "simulated_breakages_found": (sum(count > 0 for count in failures.values()), None),
        "simulated_breakage_least": (min(failures.values()), None),
    }


def journal(run):
    seeds, operations = (20_000, 1000) if run.soak else (2000, 1000)
    run.say("journals on failing disks")
    out = json.loads(run.output("osteon-journal-trials", seeds, operations))
    run.tables.append(("Journals on a disk that forgets", [(name, json.dumps(tally)) for name, tally in out.items()]))
    durable = [tally for name, tally in out.items() if name != "not_durable"]
    return {
        "journal_trials": (sum(tally["trials"] for tally in durable), None),
        "journal_acknowledged": (sum(tally["acknowledged"] for tally in durable), None),
        "journal_lost": (sum(tally["lost"] for tally in durable), None),
        "journal_bad_trials": (sum(tally["bad_trials"] for tally in durable), None),
        "journal_not_durable_lost": (out["not_durable"]["lost"], None),
    }


def server_kills(run):
    count = 10_000 if run.soak else 2000
    run.say(f"{count} killed servers")
    out = json.loads(run.output("osteon-server-kills", count))
    run.tables.append(("Killed servers", list(out.items())))
    return {
        "server_kills": (out["kills"], None),
        "server_kills_acknowledged": (out["acknowledged"], None),
        "server_kills_lost": (out["lost"] + out["twice"] + out["missing"] + out["hashes_that_differ"], None),
        "server_kills_back": (out["back_p50_ms"], None),
    }


def bad_network(run):
    run.say("real processes on bad networks")
    out = json.loads(run.output("osteon-bad-network", 50))
    run.tables.append(("Bad networks", [(name, json.dumps(kind)) for name, kind in out.items()]))
    good, bad = out["loopback"], out["bad"]
    return {
        "bad_network_runs": (bad["runs"], None),
        "bad_network_faults": (bad["faults"] + good["faults"] + bad["sent"] - bad["kept"], None),
        "bad_network_converged": (bad["converged_s"]["max"] / CONVERGED_S, None),
        "felt_loopback_p99": Measured(good["felt_ms"]["p99_median_run"] / FELT_LOOPBACK_MS,
                                      high=good["felt_ms"]["p99_worst_run"] / FELT_LOOPBACK_MS),
        "felt_bad_p99": Measured(bad["felt_ms"]["p99_median_run"] / FELT_BAD_MS,
                                      high=bad["felt_ms"]["p99_worst_run"] / FELT_BAD_MS),
    }


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


GROUPS = {"simulated": simulated, "simulated_full": simulated_full, "simulated_broken": simulated_broken, "journal": journal,
          "server_kills": server_kills, "bad_network": bad_network, "forgery": forgery, "observers": observers}
