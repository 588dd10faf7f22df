"""Figures of devices on an emulated USB: nothing may be lost on the way. Rates are the emulation's, not a device's."""
import json

CYCLES = 100_000
UNPLUGS = 10


def falcon_cycles(run):
    run.say(f"{CYCLES} frames each way with an emulated Falcon")
    out = json.loads(run.output("osteon-falcon-cycles", CYCLES, UNPLUGS))
    run.tables.append(("Novint Falcon, emulated", list(out.items())))
    return {
        "falcon_cycles": (out["samples"], None),
        "falcon_cycle_faults": (out["bad_frames"] + out["wrong_places"], None),
        "falcon_unplug_faults": (out["unplugs"] - out["unplugs_noticed"] + out["force_after_loss"], None),
        "falcon_cycle_rate": (out["cycles_per_s"], None),
    }


GROUPS = {"falcon_cycles": falcon_cycles}
