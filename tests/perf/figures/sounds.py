"""Figures of recorded sound, by the program osteon-audio."""
import re
import wave

import numpy as np

from registry import Measured

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


GROUPS = {"sound_analysis": analysis}
