"""Figures of authentication: many unauthenticated connections, and bytes of every kind. Hands are simulated."""
import functools
import json
import os
import re
import socket
import ssl
import subprocess
import time
from pathlib import Path

import numpy as np

import plans
import record
import registry
from processes import Failure, Household
from together import ROOM, Certificates

ROOT = Path(__file__).resolve().parents[3]
KNOCKS = 100_000
OPEN_KNOCKS = 60
QUIET_S = 8.0
PATIENCE_S = 10.0   # the server closes an unauthenticated connection in half of this time
SILENT_S = 0.002    # a port without TLS sends first, and at once
TLS_ALERT, MOST_ALERT_BYTES = 0x15, 16
HTTP2 = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, 4, 0, 0, 0, 0, 0])
FUZZ_SOAK = 10_000_000  # of every target
DAMAGED_SMALL, DAMAGED_LARGE = 1000, 10
FUZZED = re.compile(r"^fuzzed: (\w+) (\d+) inputs; ")


def resident_mb(pid):
    return int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6


def is_refused(line, may_stay=False):
    """True if the connection was closed with no answer, or with one alert of TLS. With `may_stay` also if nothing
    came in the whole wait."""
    said = b""
    try:
        while more := line.recv(4096):
            said += more
            if said[0] != TLS_ALERT or len(said) > MOST_ALERT_BYTES:
                return False
    except ConnectionError:
        pass
    except TimeoutError:
        return may_stay and said == b""
    return True


def knock(address, kind, waits=False):
    """One unauthenticated connection: silent (0), plain HTTP/2 (1), noise (2), or TLS without a certificate (3).
    True if it was refused.
    Any other answer counts as admitted, and so does a connection that stays open after the bytes. A silent one
    notes whether the server sends first. With `waits` it also expects that the server closes in the end.
    """
    with socket.create_connection(address, timeout=PATIENCE_S) as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # leaves no port occupied
        try:
            if kind == 0:
                if not waits:
                    line.settimeout(SILENT_S)
                return is_refused(line, may_stay=not waits)
            if kind == 1:
                line.sendall(HTTP2)
            elif kind == 2:
                line.sendall(b"\x16\x03\x01" + bytes(range(200)))
            elif kind == 3:
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
                context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
                context.set_alpn_protocols(["h2"])
                with context.wrap_socket(line) as sealed:
                    sealed.sendall(HTTP2)
                    return is_refused(sealed)
        except TimeoutError:
            return False
        except (ConnectionError, ssl.SSLError):
            return True
        return is_refused(line)


def knocks(address, count):
    """Number of refused ones among `count` unauthenticated connections of all kinds."""
    return sum(knock(address, 3 if i % 100 == 0 else i % 3, waits=i % 9999 == 3) for i in range(count))


def open_door(run, household, out):
    """Unauthenticated connections at a port that is open on purpose. Returns how many the test counts as admitted."""
    address_file = out / "logs" / "open-address"
    address_file.unlink(missing_ok=True)
    server = household.start("open-server",
                             [run.programs / "osteon-server", "--case", run.phantom(), "--listen", "127.0.0.1:0",
                              "--plain",
                                             "--address-file", address_file])
    host, port = household.wait_for_file(address_file, "osteon-server", 60.0).rsplit(":", 1)
    refused = knocks((host, int(port)), OPEN_KNOCKS)
    server.may_end = True
    server.end()
    return OPEN_KNOCKS - refused


def knocking(run):
    run.say(f"{KNOCKS} unauthenticated clients knock at a server in which a haptic client works")
    out = run.folder / "knocking"
    (out / "logs").mkdir(parents=True, exist_ok=True)
    certificates = Certificates(run.programs, out)  # of a folder that is new in every run
    with Household(out / "logs") as household:
        noticed = open_door(run, household, out)
        address_file = out / "logs" / "address"
        address_file.unlink(missing_ok=True)
        server = household.start("osteon-server",
                                 [run.programs / "osteon-server", "--case", run.phantom(), "--listen", "127.0.0.1:0",
                                                   *certificates.server, "--address-file", address_file, "--summary",
                                  out / "server.json",
                                                   "--journal", out / f"{ROOM}.journal"])
        address = household.wait_for_file(address_file, "osteon-server", 60.0)
        host, port = address.rsplit(":", 1)
        plan = out / "plan.json"
        # Slow enough that it works during the whole test.
        plan.write_text(json.dumps(plans.drill("rig", feed_mm_per_s=0.14, beyond_mm=1)), encoding="utf-8")
        hand = household.start("hand",
                               [run.programs / "osteon-haptic", "--server", address,
                                *certificates.person("anna", "trainee"), "--room", ROOM, "--plan", plan,
                                "--cut-log", out / "cuts.csv", "--summary", out / "hand.json",
                                "--session-log", out / "hand.csv"])
        hand.may_end = True
        time.sleep(QUIET_S)
        pid = int(subprocess.run(["pgrep", "-f", str(address_file)], capture_output=True, text=True,
                                 check=True).stdout.split()[0])
        memory, began = resident_mb(pid), time.monotonic_ns()
        refused = knocks((host, int(port)), KNOCKS)
        ended, after = time.monotonic_ns(), resident_mb(pid)
        if hand.exit_code is not None:
            raise Failure("the haptic client ended before the others did; its last lines:", hand.last_words())
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
    said = [line for line in log if " refused who=" in line]
    if not any("reason=tls" in line for line in said):
        raise Failure("the server's log names no unauthenticated client; its last lines:", "\n".join(log[-5:]))
    same = record.read_json(out / "server.json")["field_hash"] == record.read_json(out / "hand.json")["field_hash"]
    run.tables.append(("Unauthenticated connections",
                       [("seconds", round((ended - began) / 1e9, 1)), ("cuts meanwhile", int(during.sum())),
                                                ("commit p99 before, ms",
                                                 round(float(np.percentile(took[before], 99)), 2)),
                                                ("commit p99 meanwhile, ms",
                                                 round(float(np.percentile(took[during], 99)), 2)),
                                                ("memory before, MB", round(memory, 1)),
                        ("memory after, MB", round(after, 1)),
                                                ("lines that the server logged", len(log))]))
    return {
        "knocks": (KNOCKS, None),
        "knocks_let_in": (KNOCKS - refused, None),
        "knocks_noticed": (noticed, None),
        "knocks_memory": (max(0.0, after - memory), memory),
        "knocks_logged": (len(said), None),
        "knocks_commit": (float(np.percentile(took[during], 50)), float(np.percentile(took[before], 50))),
        "knocks_differences": (0 if same else 1, None),
    }


def fuzz(target, inputs, run):
    """Runs changed inputs of one target, in as many processes as there are processors. Each process makes different
    changes."""
    inputs = max(inputs, FUZZ_SOAK) if run.soak else inputs
    many = len(os.sched_getaffinity(0))
    run.say(f"{inputs} changed inputs: {target}")
    began, texts = time.monotonic(), [run.folder / f"fuzz-{target}-{i}.txt" for i in range(many)]
    processes = []
    try:
        for i, text in enumerate(texts):
            asked = {"OSTEON_FUZZ_TARGET": target, "OSTEON_FUZZ_RUNS": str(-(-inputs // many)),
                     "OSTEON_FUZZ_SEED": str(i + 1)}
            with text.open("w", encoding="utf-8") as out:
                processes.append(subprocess.Popen([run.programs / "fuzz.mutations", "--gtest_filter=*MutatedInputs"],
                                                  stdout=out,
                                                  stderr=subprocess.STDOUT, env={**os.environ, **asked}))
        codes = [process.wait() for process in processes]
    finally:
        for process in processes:
            process.kill()  # those that still run after a stop
            process.wait()
    done, rows = 0, [("seconds", round(time.monotonic() - began))]
    for code, text in zip(codes, texts):
        lines = text.read_text(encoding="utf-8", errors="replace").splitlines()
        said = [line for line in lines if line.startswith("fuzzed: ")]
        rows += [(target, line.removeprefix("fuzzed: ")) for line in said]
        if code == 0 and (last := FUZZED.match(said[0]) if said else None) and last[1] == target:
            done += int(last[2])  # printed after the last of them
        else:
            run.tables.append((f"fuzzing {target} failed", [(line,) for line in lines[-5:] or ["it says nothing"]]))
    run.tables.append(("Changed inputs", rows))
    return {f"fuzzed_{target}": registry.Measured(done, None, threads=many)}


def damaged_cases(run):
    """Cases with a few changed bytes, uploaded."""
    run.say(f"{DAMAGED_SMALL} damaged small cases and {DAMAGED_LARGE} large ones")
    out = json.loads(run.output("osteon-case-changes", DAMAGED_SMALL, DAMAGED_LARGE))
    run.tables.append(("damaged cases", list(out.items())))
    return {
        "damaged_cases": (out["changed"], None),
        "damaged_cases_taken": (out["other"], None),
        "damaged_cases_memory": (out["peak_mib"], None),
        "damaged_cases_sentence": (out["longest_sentence_bytes"], None),
    }


GROUPS = {"knocking": knocking, "damaged_cases": damaged_cases,
          **{f"fuzz_{target}": functools.partial(fuzz, target, inputs) for target, _, _, inputs in registry.FUZZED}}
