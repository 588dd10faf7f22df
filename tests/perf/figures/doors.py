"""Figures of closed doors: strangers who knock as often as they like, and bytes of every kind. Hands are simulated."""
import json
import os
import socket
import ssl
import subprocess
import time
from pathlib import Path

import numpy as np

import plans
import record
from processes import Failure, Household
from together import ROOM, Doors

ROOT = Path(__file__).resolve().parents[3]
KNOCKS = 100_000
QUIET_S = 8.0
HTTP2 = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, 4, 0, 0, 0, 0, 0])
FUZZ_RUNS = 10_000_000
FUZZ_CALLS = 300_000


def resident_mb(pid):
    return int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6


def knock(address, kind):
    """One stranger: who says nothing, speaks plain HTTP/2, sends noise, or begins TLS without a certificate."""
    with socket.create_connection(address, timeout=10.0) as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # no port stays occupied behind it
        try:
            if kind == 1:
                line.sendall(HTTP2)
            elif kind == 2:
                line.sendall(b"\x16\x03\x01" + bytes(range(200)))
            elif kind == 3:
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
                context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
                context.set_alpn_protocols(["h2"])
                line.settimeout(10.0)
                with context.wrap_socket(line) as sealed:
                    sealed.sendall(HTTP2)
                    return not sealed.recv(1)
        except OSError:
            return True  # it was hung up on
    return True


def knocking(run):
    run.say(f"{KNOCKS} strangers at the door of a server in which a hand works")
    out = run.folder / "knocking"
    (out / "logs").mkdir(parents=True, exist_ok=True)
    doors = Doors(run.programs, out)  # of a folder that is new with every run
    with Household(out / "logs") as household:
        address_file = out / "logs" / "address"
        address_file.unlink(missing_ok=True)
        server = household.start("osteon-server", [run.programs / "osteon-server", "--case", run.phantom(), "--listen", "127.0.0.1:0",
                                                   *doors.server, "--address-file", address_file, "--summary", out / "server.json",
                                                   "--journal", out / f"{ROOM}.journal"])
        address = household.wait_for_file(address_file, "osteon-server", 60.0)
        host, port = address.rsplit(":", 1)
        plan = out / "plan.json"
        # Slow enough that it is at work all the while.
        plan.write_text(json.dumps(plans.drill("rig", feed_mm_per_s=0.25, beyond_mm=1)), encoding="utf-8")
        hand = household.start("hand", [run.programs / "osteon-haptic", "--server", address, *doors.person("anna", "trainee"),
                                        "--room", ROOM, "--plan", plan, "--cut-log", out / "cuts.csv", "--summary", out / "hand.json",
                                        "--session-log", out / "hand.csv"])
        hand.may_end = True
        time.sleep(QUIET_S)
        pid = int(subprocess.run(["pgrep", "-f", str(address_file)], capture_output=True, text=True, check=True).stdout.split()[0])
        memory, began = resident_mb(pid), time.monotonic_ns()
        refused = sum(knock((host, int(port)), 3 if i % 100 == 0 else i % 3) for i in range(KNOCKS))
        ended, after = time.monotonic_ns(), resident_mb(pid)
        if hand.exit_code is not None:
            raise Failure("the hand ended before the strangers did; its last lines:", hand.last_words())
        code = hand.wait(240.0)
        household.check()
        log = server.log.read_text(encoding="utf-8", errors="replace").splitlines()
        server.may_end = True
        server.end()
    if code != 0:
        raise Failure(f"the hand ended with {code}; its last lines:", hand.last_words())
    cuts = record.read_table(out / "cuts.csv")
    took = (cuts["confirmed_mono_ns"] - cuts["closed_mono_ns"]) / 1e6
    during = (cuts["closed_mono_ns"] >= began) & (cuts["closed_mono_ns"] <= ended) & (cuts["room_seq"] > 0)
    before = (cuts["closed_mono_ns"] < began) & (cuts["room_seq"] > 0)
    same = record.read_json(out / "server.json")["field_hash"] == record.read_json(out / "hand.json")["field_hash"]
    run.tables.append(("Strangers at the door", [("seconds", round((ended - began) / 1e9, 1)), ("cuts meanwhile", int(during.sum())),
                                                ("commit p99 before, ms", round(float(np.percentile(took[before], 99)), 2)),
                                                ("commit p99 meanwhile, ms", round(float(np.percentile(took[during], 99)), 2)),
                                                ("memory before, MB", round(memory, 1)), ("memory after, MB", round(after, 1)),
                                                ("lines that the server logged", len(log))]))
    return {
        "knocks": (KNOCKS, None),
        "knocks_let_in": (KNOCKS - refused, None),
        "knocks_memory": (max(0.0, after - memory), memory),
        "knocks_logged": (len([line for line in log if "refus" in line or "turned away" in line]), None),
        "knocks_commit": (float(np.percentile(took[during], 50)), float(np.percentile(took[before], 50))),
        "knocks_differences": (0 if same else 1, None),
    }


def door_fuzz(run):
    values = {}
    for target in ("ticket", "upload", "supervision", "annotation", "calls"):
        # A call takes half a millisecond, since a server answers it.
        runs = FUZZ_RUNS if target != "calls" or run.soak else FUZZ_CALLS
        run.say(f"{runs} changed inputs: {target}")
        result = subprocess.run([run.programs / "fuzz.mutations", "--gtest_filter=*MutatedInputs"], capture_output=True, text=True, check=False,
                                env={**os.environ, "OSTEON_FUZZ_TARGET": target, "OSTEON_FUZZ_RUNS": str(runs)})
        values[f"fuzzed_{target}"] = (runs if result.returncode == 0 else 0, None)
        if result.returncode != 0:
            run.tables.append((f"fuzzing {target} failed", [(line,) for line in (result.stdout + result.stderr).splitlines()[-5:]]))
    return values


GROUPS = {"knocking": knocking, "door_fuzz": door_fuzz}
