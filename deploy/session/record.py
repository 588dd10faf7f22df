"""Reads the files of a session's programs. Computes the numbers that need files of several programs."""
import csv
import json
import platform
import struct
from pathlib import Path

import numpy as np

from processes import Failure


def read_table(file: Path):
    """A CSV log as {column: array}. Numbers if every entry is a number, else texts."""
    if not file.exists():
        raise Failure(f"{file.name} was not written, although the session ended")
    with open(file, newline="", encoding="utf-8") as lines:
        rows = list(csv.reader(lines))
    if not rows:
        raise Failure(f"{file} is empty; it should begin with the names of its columns")
    columns = {}
    for i, name in enumerate(rows[0]):
        values = [row[i] for row in rows[1:] if len(row) == len(rows[0])]
        for kind in (np.int64, np.float64):
            try:
                columns[name] = np.array(values, dtype=kind)
                break
            except ValueError:
                continue
        else:
            columns[name] = np.array(values)
    return columns


def read_json(file: Path):
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise Failure(f"{file.name} was not written, although the session ended") from None
    except ValueError as error:
        raise Failure(f"{file} is not JSON: {error}") from None


def spread(values_ms):
    """Median, 99th percentile and count of durations in ms. None for a value that cannot be computed."""
    values = np.asarray(values_ms, dtype=float)
    if values.size == 0:
        return {"p50": None, "p99": None, "max": None, "count": 0}
    return {"p50": round(float(np.percentile(values, 50)), 3), "p99": round(float(np.percentile(values, 99)), 3),
            "max": round(float(values.max()), 3), "count": int(values.size)}


def after_cut_ms(cuts, frames, moment):
    """For each cut: the time from its end in the haptic client to `moment` of the first frame that contains it."""
    order = np.argsort(frames["room_seq"], kind="stable")
    seqs, times = frames["room_seq"][order], frames[moment][order]
    # The earliest moment of a row with this seq or a later one.
    earliest = np.minimum.accumulate(times[::-1])[::-1]
    first = np.searchsorted(seqs, cuts["room_seq"], side="left")
    seen = first < len(seqs)
    return (earliest[first[seen]] - cuts["closed_mono_ns"][seen]) / 1e6


def after_state_ms(session, states, moment):
    """For each cutting state that was played: the time since it was made in the haptic client."""
    seqs, first = np.unique(session["state_seq"], return_index=True)
    made = dict(zip(seqs.tolist(), session["mono_ns"][first].tolist()))
    return np.array([(t - made[s]) / 1e6 for s, t in zip(states["state_seq"].tolist(), states[moment].tolist())
                     if s in made and t > 0])


def latencies(folder: Path):
    """The session's latencies in ms. All logs have CLOCK_MONOTONIC of one host, so they can be subtracted."""
    cuts = read_table(folder / "cuts.csv")
    committed = {name: values[cuts["room_seq"] > 0] for name, values in cuts.items()}
    result = {"cut_to_commit": spread((committed["confirmed_mono_ns"] - committed["closed_mono_ns"]) / 1e6)}
    if (folder / "frames.csv").exists():
        frames = read_table(folder / "frames.csv")
        result["cut_to_mesh"] = spread(after_cut_ms(committed, frames, "received_mono_ns"))
        result["cut_to_picture"] = spread(after_cut_ms(committed, frames, "rendered_mono_ns"))
    if (folder / "states.csv").exists():
        session, states = read_table(folder / "session.csv"), read_table(folder / "states.csv")
        result["cut_to_sound"] = spread(after_state_ms(session, states, "sounded_mono_ns"))
    return result


def stretches(session):
    """The rows of the session in which each tool was cutting, from its first to its last cut: [(tool, first, last)]."""
    result = []
    tools = session["tool"]
    changes = np.flatnonzero(np.r_[True, tools[1:] != tools[:-1]])
    for start, end in zip(changes, np.r_[changes[1:], len(tools)]):
        cutting = np.flatnonzero(session["phase"][start:end] == "cutting") + start
        if len(cutting) > 0:
            result.append((str(tools[start]), int(cutting[0]), int(cutting[-1])))
    return result


def read_wav(file: Path):
    """Samples per second, and the sound as one channel of floats. PCM of 16, 24 or 32 bits or 32-bit float."""
    data = file.read_bytes()
    if data[:4] != b"RIFF" or data[8:12] != b"WAVE":
        raise Failure(f"{file} is not a WAV file")
    kind = channels = rate = bits = 0
    at = 12
    while at + 8 <= len(data):
        name, size = data[at:at + 4], struct.unpack_from("<I", data, at + 4)[0]
        if name == b"fmt ":
            kind, channels, rate, _, _, bits = struct.unpack_from("<HHIIHH", data, at + 8)
            if kind == 0xFFFE:  # extensible: the format is at the start of the sub-format
                kind = struct.unpack_from("<H", data, at + 8 + 24)[0]
        elif name == b"data" and channels:
            raw = data[at + 8:at + 8 + size]
            raw = raw[:len(raw) // (channels * bits // 8) * (channels * bits // 8)]
            if kind == 3 and bits == 32:
                samples = np.frombuffer(raw, "<f4").astype(float)
            elif kind == 1 and bits in (16, 32):
                samples = np.frombuffer(raw, f"<i{bits // 8}") / 2.0 ** (bits - 1)
            elif kind == 1 and bits == 24:
                bytes3 = np.frombuffer(raw, np.uint8).reshape(-1, 3).astype(np.int32)
                samples = ((bytes3[:, 0] << 8 | bytes3[:, 1] << 16 | bytes3[:, 2] << 24) >> 8) / 2.0 ** 23
            else:
                raise Failure(f"{file} holds a kind of sound that the report cannot read ({kind}, {bits} bits)")
            return rate, samples.reshape(-1, channels).mean(axis=1)
        at += 8 + size + (size & 1)
    raise Failure(f"{file} holds no sound")


def machine():
    """A description of the machine without its host name."""
    model = platform.machine()
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    except OSError:
        pass
    import os
    return {"processor": model, "cores": os.cpu_count(), "kernel": platform.release().split("-")[0]}
