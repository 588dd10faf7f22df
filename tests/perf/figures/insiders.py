"""Figures of attackers who have, or once had, a certificate. They attack the server directly and through the proxy."""
import os
import re
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import raw_http2
from delay_line import DelayLine
from insider_attack import GET_STATUS, START_S
from processes import Failure, Household
from together import ROOM, Certificates

ROOT = Path(__file__).resolve().parents[3]
ATTACK = Path(__file__).resolve().parent / "insider_attack.py"
HAPROXY = shutil.which("haproxy", path="/usr/sbin:/usr/bin")
MISSING = "haproxy is not installed; deploy/install does that"
WAYS = ("direct", "proxied")
ATTACKS = ("killing", "resets")
HOLDERS = ("valid", "revoked", "none")   # of a certificate
ATTACKERS = 4                            # connections at a time, each opened again after it was closed
REVOKED_S = 1.5                          # until it holds: the lists are read at least twice a second
ATTACK_S = 24.0                          # the burst that the limits allow at first is less than 1 % of it
CALL_EVERY_S = 0.0125                    # the server allows a person 100 calls a second
DELAY_S = 0.075                          # one way
UPLOADS, UPLOAD_MIB = 3, 32


def free_port():
    with socket.socket() as line:
        line.bind(("127.0.0.1", 0))
        return line.getsockname()[1]


class Place:
    """A server with a room and, if `proxied`, the proxy in front of it, with certificates of their own."""

    def __init__(self, run, household, folder, proxied, *more):
        folder.mkdir(parents=True, exist_ok=True)
        self.certificates = Certificates(run.programs, folder)
        self.programs, self.folder, server_folder = run.programs, folder, folder / "certs" / "server"
        address_file = folder / "address"
        address_file.unlink(missing_ok=True)
        socket_file = folder / "proxy.sock"
        self.server = household.start("osteon-server", [
            run.programs / "osteon-server", "--case", run.phantom(), "--listen", "127.0.0.1:0",
                                                        *self.certificates.server,
            "--address-file", address_file, *(["--proxy-socket", socket_file] if proxied else []), *more])
        address = household.wait_for_file(address_file, "osteon-server", 60.0)
        self.children = [self.server]
        if proxied:
            address = f"127.0.0.1:{free_port()}"
            admin = folder / "admin.sock"
            environment = {"OSTEON_LISTEN": address, "OSTEON_CERTIFICATES": str(server_folder),
                           "OSTEON_PROXY_SOCKET": str(socket_file), "OSTEON_ADMIN_SOCKET": str(admin)}
            proxy = household.start("haproxy", [HAPROXY, "-db", "-f", ROOT / "deploy" / "haproxy.cfg"],
                                    {**os.environ, **environment})
            self.children.append(proxy)
            household.start("proxy-revoked", [ROOT / "deploy" / "proxy-revoked", "--watch", admin, server_folder])
        self.address = address
        self.host, self.port = address.rsplit(":", 1)[0], int(address.rsplit(":", 1)[1])
        wait_for_port(self.host, self.port)

    def person(self, name, role):
        """Options of a client of a person, with the person's folder and ticket."""
        options = self.certificates.person(name, role)
        return options, options[1], options[3].read_text(encoding="utf-8").split()[0]

    def memory_mib(self):
        return sum(resident_mib(child.pid) for child in self.children)

    def said(self):
        lines = "\n".join(child.log.read_text(encoding="utf-8", errors="replace") for child in self.children)
        return lines + "\n" + "\n".join(line for child in self.children[1:] for line in child.new_lines())


def wait_for_port(host, port, patience_s=20.0):
    deadline = time.monotonic() + patience_s
    while True:
        try:
            socket.create_connection((host, port), timeout=1.0).close()
            return
        except OSError:
            if time.monotonic() > deadline:
                raise Failure(f"nobody listens on {host}:{port}") from None
            time.sleep(0.05)


def resident_mib(pid):
    text = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(re.search(r"^VmRSS:\s+(\d+)", text, re.M)[1]) / 1024.0


# What another person notices during an attack.

def call_times_ms(line, headers, seconds):
    """Measures a person's calls, one after the other."""
    until, times = time.monotonic() + seconds, []
    while (began := time.monotonic()) < until:
        if not line.finish(line.call(GET_STATUS, headers)):
            raise Failure("a call of somebody else was not answered")
        times.append((time.monotonic() - began) * 1e3)
        time.sleep(max(0.0, CALL_EVERY_S - (time.monotonic() - began)))
    return times


def p99(times):
    return float(np.percentile(times, 99))


def is_named(said, holder, who, source):
    """True if a line of the logs names the attacker and the source address. Without a certificate, only the address."""
    place = re.escape(source)
    if holder == "none":
        return re.search(rf"\b{place}\b", said) is not None
    line = rf"refused who=\"?{who}\b.*\b{place}\b|^{place}:\d+ .*\"{who}\""
    return re.search(line, said, re.M) is not None


def attacked(run, household, place, way, kind, holder):
    """Runs one attack. Returns its result as a row."""
    who = f"{kind}-{holder}"
    source = f"127.0.1.{1 + 3 * ATTACKS.index(kind) + HOLDERS.index(holder)}"  # each has an address of its own
    _, person, _ = place.person(who, "observer")
    if holder == "revoked":
        place.certificates.revoke(who)
        time.sleep(REVOKED_S)
    _, bystander, ticket = place.person("anna", "observer")
    headers = raw_http2.admission(ticket, ROOM)
    command = [sys.executable, "-EB", ATTACK, kind, place.host, place.port, source,
               "" if holder == "none" else person, ATTACK_S]
    with raw_http2.Connection((place.host, place.port), bystander) as line:
        quiet = call_times_ms(line, headers, ATTACK_S / 2)
        memory = place.memory_mib()
        # Real attackers have machines of their own. Here they get the processor time that the others leave.
        attackers = [household.start(f"{way}-{who}-{i}", ["chrt", "--idle", "0", *command])
                     for i in range(ATTACKERS)]
        call_times_ms(line, headers, START_S / 2)
        times = call_times_ms(line, headers, START_S / 2 + ATTACK_S)
        grown = place.memory_mib() - memory
        quiet += call_times_ms(line, headers, ATTACK_S / 2)
    for attacker in attackers:
        attacker.may_end = True
        if attacker.wait(30.0) != 0:
            raise Failure("an attacker failed:", attacker.last_words())
    attempts = sum(int(attacker.next_line(5.0)) for attacker in attackers)
    household.check()  # the process is alive
    return {"way": way, "attack": kind, "certificate": holder, "attempts": attempts, "quiet": p99(quiet),
            "p99": p99(times), "worst": max(times), "memory": grown,
            "named": is_named(place.said(), holder, who, source)}


def attacks(run):
    rows = []
    ways = WAYS if HAPROXY else WAYS[:1]
    if not HAPROXY:
        run.skip("insider_proxied", MISSING)
    for way in ways:
        run.say(f"attacks of insiders, {way}")
        with Household(run.folder / "insiders" / way / "logs") as household:
            place = Place(run, household, run.folder / "insiders" / way, way == "proxied",
                          "--journal", run.folder / "insiders" / way / f"{ROOM}.journal")
            rows += [attacked(run, household, place, way, kind, holder) for kind in ATTACKS for holder in HOLDERS]
            for child in household.children:
                child.may_end = True
    run.tables.append(("Attacks of insiders", [
        (f"{row['way']}, {row['attack']}, certificate {row['certificate']}",
         f"{row['attempts']} attempts, p99 of another's calls {row['quiet']:.2f} -> {row['p99']:.2f} ms, "
         f"worst {row['worst']:.1f} ms, memory +{row['memory']:.1f} MiB{'' if row['named'] else ', NOT NAMED'}")
        for row in rows]))
    values = {}
    for way in ways:
        suffix = "_proxied" if way == "proxied" else ""
        of_way = [row for row in rows if row["way"] == way]
        for kind in ATTACKS:
            ratios = [row["p99"] / row["quiet"] for row in of_way if row["attack"] == kind]
            values[f"insider{suffix}_{kind}_p99"] = (max(ratios), None)
        values[f"insider{suffix}_memory"] = (max(0.0, *(row["memory"] for row in of_way)), None)
        values[f"insider{suffix}_unnamed"] = (sum(not row["named"] for row in of_way), None)
    return values


def uploads(run):
    """Time to send bytes over a connection of 150 ms, direct over proxied. The relay delays and does not limit the
    rate."""
    if not HAPROXY:
        run.skip("proxy_upload_ratio", MISSING)
        return {}
    run.say("uploads over a line of 150 ms, direct and through the proxy")
    folder = run.folder / "insider-uploads"
    folder.mkdir(parents=True, exist_ok=True)
    archive = folder / "no-case.zip"
    archive.write_bytes(os.urandom(UPLOAD_MIB << 20))
    took = {way: [] for way in WAYS}
    for way in WAYS * UPLOADS:
        shutil.rmtree(folder / way, ignore_errors=True)
        with Household(folder / way / "logs") as household:
            place = Place(run, household, folder / way, way == "proxied", "--rooms", folder / way / "rooms",
                          "--uploads", folder / way / "kept")
            took[way].append(upload(place, archive))
            for child in household.children:
                child.may_end = True
    ratio = float(np.median(took["direct"]) / np.median(took["proxied"]))
    run.tables.append((f"Uploads of {UPLOAD_MIB} MiB at a round trip of 150 ms",
                       [(way, ", ".join(f"{s:.2f} s" for s in took[way])) for way in WAYS]))
    return {"proxy_upload_ratio": (ratio, None)}


def upload(place, archive):
    """Seconds from the first byte until the server has answered, after the last one, that these bytes are not an
    archive."""
    options = place.certificates.person("olga", "operator", room="*")
    began, said = None, []
    with DelayLine((place.host, place.port), DELAY_S) as line:
        command = [place.programs / "osteon-server", "cases", "upload", archive, "--server", line.address, *options]
        client = subprocess.Popen([*map(str, command)], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        for text in client.stderr:
            said.append(text.strip())
            if text.strip() == "upload: 0 %":
                began = time.monotonic()
        client.wait()
        ended = time.monotonic()
    if began is None or "upload: 100 %" not in said or "archive" not in said[-1]:
        raise Failure("an upload failed:", "\n".join(said[-5:]))
    return ended - began


GROUPS = {"insiders": attacks, "insider_uploads": uploads}
