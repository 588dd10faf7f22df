"""Figures of recorded sound, by the program osteon-audio."""
import json
import re
import shutil
import wave
from pathlib import Path

import numpy as np

from registry import Measured

# Runs a program beside a sound server without a card.
NULL_SINK = Path(__file__).resolve().parents[3] / "deploy/with-null-sink"

RATE_HZ, SECONDS = 48000, 30


def recording(file):
    """Half a minute of a drill: a room, free running, and bone, as lines in noise."""
    random = np.random.default_rng(1)
    time = np.arange(RATE_HZ * SECONDS) / RATE_HZ
    loud = np.select([time < 2, time < 8, time < 26], [0.001, 0.03, 0.1], 0.03)
    lines = sum(np.sin(2 * np.pi * hz * time) for hz in (1120.0, 4015.0, 5353.0))
    samples = loud * (lines + random.standard_normal(time.size)) / 2
    with wave.open(str(file), "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(RATE_HZ)
        out.writeframes((32767 * samples.clip(-1, 1)).astype("<i2").tobytes())


def analysis(run):
    run.say("analysis of a recording")
    file = run.folder / "recording.wav"
    recording(file)
    speeds = [float(re.search(r"([\d.]+) times as fast", run.output("osteon-audio", "analyse", file))[1])
              for _ in range(5)]
    return {"sound_analysis_speed": Measured(float(np.median(speeds)), None, min(speeds), max(speeds), 1)}


# Licences are in the README of that folder.
RECORDINGS = {"drill": "chai3d_drill.wav", "saw": "opensfx_40_circular_saw.wav",
              "hammer": "opensfx_39_smithy_hammer.wav"}


def modelled(run, file, *arguments):
    """The text of osteon-audio model, and how many times as fast as it sounds it was."""
    text = run.output("osteon-audio", "model", file, *arguments)
    return text, float(re.search(r"([\d.]+) times as fast", text)[1])


def models(run):
    run.say("spectral models of recordings")
    file = run.folder / "recording.wav"
    recording(file)
    values = {}
    for name, refine in (("sound_model_speed", 0), ("sound_model_refined_speed", 2)):
        speeds = [modelled(run, file, "--refine", refine)[1] for _ in range(3)]
        values[name] = Measured(float(np.median(speeds)), None, min(speeds), max(speeds), 1)
    folder = run.shared_data("sound")
    for name, wav in RECORDINGS.items():
        if not folder:
            run.skip(f"sound_model_{name}", "there is no shared/data beside the checkout")
            numbers = [None] * 4
        else:
            text, _ = modelled(run, folder / wav, "--channel", "left")
            snr = re.search(r"^sines, with phases +(\S+)", text, re.M)[1]
            numbers = [float(x) for x in (snr, *re.search(r"^the model, no phases +\S+ +(.*)$", text, re.M)[1].split())]
        values |= {f"sound_model_{name}_{what}": Measured(number)
                   for what, number in zip(("snr", "psd", "mel", "envelope"), numbers)}
    return values


def binaural(run):
    run.say("synthesis for headphones")
    speeds = {"still": [], "moving": []}
    for _ in range(5):
        text = run.output("osteon-sound-bench")
        for name, values in speeds.items():
            values.append(float(re.search(rf"^{name} ([\d.]+) times as fast", text, re.M)[1]))
    return {f"sound_binaural_{name}_speed": Measured(float(np.median(values)), None, min(values), max(values), 1)
            for name, values in speeds.items()}


def tools(run):
    """What 8.5.4 says of drilling, on the synthesised sound."""
    run.say("sound of the tools")
    runs = [json.loads(run.output("osteon-tool-sounds")) for _ in range(3)]
    speeds = [numbers.pop("speed") for numbers in runs]
    values = {f"tool_sound_{name}": Measured(number) for name, number in runs[0].items()}
    return values | {"tool_sound_speed": Measured(float(np.median(speeds)), None, min(speeds), max(speeds), 1)}


# Of osteon-sound-classifier: by the spectrum, by that of windows of equal level, and by the level alone.
LISTENERS, SNRS_DB = ("spectrum", "equal_rms", "level_only"), (20, 6)


def classes(run):
    run.say("what a drill does, told by its sound alone")
    trials = json.loads(run.output("osteon-sound-classifier", "--json"))
    values = {}
    for listener in LISTENERS:
        for snr in SNRS_DB:
            trial = trials[f"{listener}_{snr}db"]
            for what in ("accuracy", "mean_recall", "transitions"):
                sets = [numbers[what] for numbers in trial["sets"].values()]
                values[f"sound_classes_{listener}_{what}_{snr}db"] = Measured(trial[what], None, min(sets), max(sets))
            run.tables.append((f"sound classes, {listener}, noise {snr} dB below: what it was, and frames named so",
                               [("", *trials["classes"])] +
                               [(name, *row) for name, row in zip(trials["classes"], trial["confusion"])]))
    return values


def played(run, group, *arguments):
    """What osteon-sound-output says; nothing without a sound server."""
    if not shutil.which("pulseaudio"):
        run.skip(group, "PulseAudio is not installed")
        return None
    return json.loads(run.output(NULL_SINK, run.programs / "osteon-sound-output", *arguments))


GAPLESS_MINUTES = 10
JUST_NOTICED_MS = 24.0  # [A] of touch and sound
STAGES = (("arrived", "from the server's acceptance of a cut to its first changed sample on the monitor"),
          ("server_and_network", "of it until the client has the state"),
          ("wait_for_render", "until a callback takes it"),
          ("render_to_monitor", "from there until it comes out"),
          ("played", "from the acceptance until it would be played, by the clock of the sink"),
          ("monitor_late", "what the monitor adds: how late its pieces come after the soonest one"))


def gapless(run):
    run.say(f"{GAPLESS_MINUTES} minutes of drilling, for gaps")
    found = played(run, "sound_output", "gapless", GAPLESS_MINUTES, "--listen", "headphones", "--awake")
    if not found:
        return {f"sound_output_{name}": Measured(None)
                for name in ("compared", "gaps", "gaps_without_stall", "differing", "share", "share_without_stall",
                             "allocations")}
    run.tables.append(("output of the sound", [(name, found[name]) for name in sorted(found)]))
    return {"sound_output_compared": Measured(found["seconds_equal"] / (60 * GAPLESS_MINUTES)),
            "sound_output_gaps": Measured(found["gaps"], found["gaps_by_clock"]),
            "sound_output_gaps_without_stall": Measured(found["gaps_without_stall"], found["stalls"]),
            "sound_output_differing": Measured(found["differing_frames"] + found["missing_frames"]),
            "sound_output_share": Measured(found["share_max"], found["share_p99"]),
            "sound_output_share_without_stall": Measured(found["share_max_without_stall"], found["disturbed"]),
            "sound_output_allocations": Measured(found["allocations"], found["allocations_of_thread"])}


def latency(run):
    run.say("from cuts on a server to the monitor of the sound")
    found = played(run, "sound_latency", "latency", 300)
    if not found:
        return {f"sound_latency_{name}": Measured(None) for name in ("p50", "p95", "p99", "unheard")}
    arrived, counts, bin_ms = found["arrived_ms"], found["histogram"]["counts"], found["histogram"]["bin_ms"]
    run.tables.append(("from the acceptance of a cut to the monitor, ms, and number of cuts",
                       [(f"{bin_ms * i:g} to {bin_ms * (i + 1):g}", count) for i, count in enumerate(counts) if count]))
    run.tables.append(("from the acceptance of a cut to the monitor, ms", [("", "p50", "p95", "p99", "max")] +
                       [(what, *(found[f"{name}_ms"][part] for part in ("p50", "p95", "p99", "max")))
                        for name, what in STAGES]))
    return {"sound_latency_p50": Measured(arrived["p50"]),
            "sound_latency_p95": Measured(arrived["p95"] / JUST_NOTICED_MS, arrived["p95"]),
            "sound_latency_p99": Measured(arrived["p99"], arrived["max"]),
            "sound_latency_unheard": Measured(found["unheard"])}


GROUPS = {"sound_analysis": analysis, "sound_binaural": binaural, "sound_model": models, "sound_classes": classes,
          "sound_output": gapless, "sound_latency": latency,
          "tool_sound": tools}
