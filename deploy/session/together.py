"""deploy/demo --together: two simulated surgeons and an instructor on one bone, over mutual TLS, and a log of it."""
import html
import json
import re
import subprocess
import time
import typing
from pathlib import Path

import h5py
import numpy as np

import plans
import plots
import record
import report
from processes import Failure, Household
from screen import Watcher, start_screen
from session import ROOT, Viewer, case_info, check_journal, look_at_all, unit

ROOM = "theatre"
TRAINEES = {"anna": "trainee", "ben": "trainee"}
INSTRUCTOR = "berg"
OBSERVER = "class"
GUEST = "guest"  # at the window
# Largest growth of the device's force in a millisecond without motion of the hand, and the stiffest coupling.
SLEW_N_PER_MS = 0.5
COUPLING_N_PER_MM = 50.0
ROUNDING_N = 2e-3  # of forces recorded as single floats
PATIENCE_S = 60.0
# Stay after the work, so that each hand receives the last changes of the other.
STAYS_S = 12.0


class Hand(typing.NamedTuple):
    number: str  # its name in the console
    cuts: int    # its accepted cuts


class Console:
    """osteon-viewer --console: one line for each command, one for its answer."""

    def __init__(self, household, child, say):
        self._household, self._child, self._say = household, child, say

    def do(self, command, patience_s=30.0):
        self._child.say(command)
        deadline = time.monotonic() + patience_s
        while (answer := self._child.next_line(0.2)) is None:
            self._household.check()
            if time.monotonic() > deadline:
                raise Failure(f"the instructor's console did not answer '{command}' within {patience_s:.0f} s; "
                              "its last lines:", self._child.last_words())
        if not answer.startswith("ok"):
            raise Failure(f"the instructor's console could not '{command}': {answer}")
        self._say(f"       Dr. Berg: {command}")
        return answer

    def hands(self):
        """The hands in the room, by the names of their persons."""
        self._child.say("people")
        answer = self._child.next_line(10.0) or ""
        found = {}
        # Words of an instructor are in quotes of their own, whatever they contain.
        for number, name, more in re.findall(r'(#\d+) "((?:[^"\\]|\\.)*)"(.*?)(?=; #\d+ "|$)', answer):
            count = re.search(r" cuts (\d+)$", more)
            if count:
                found[name] = Hand(number, int(count.group(1)))
        return found


class Certificates:
    """A local authority, the server's certificate, and for each person a certificate and a ticket for the room."""

    def __init__(self, programs, folder):
        self._programs, self._folder = programs, folder / "certs"
        self._run(ROOT / "deploy" / "certs", "--into", self._folder, "authority")
        self._run(ROOT / "deploy" / "certs", "--into", self._folder, "server", "localhost", "127.0.0.1")
        self.server = ["--certificates", self._folder / "server"]

    def person(self, name, role, room=ROOM):
        self._run(ROOT / "deploy" / "certs", "--into", self._folder, "person", name)
        ticket = self._run(self._programs / "osteon-server", "ticket",
                           "--key", self._folder / "authority" / "tickets.key",
                           "--room", room, "--user", name, "--role", role, "--hours", "1")
        file = self._folder / "people" / name / "ticket"
        file.write_text(ticket, encoding="utf-8")
        file.chmod(0o600)
        return ["--certificates", file.parent, "--ticket", file]

    def revoke(self, name):
        self._run(ROOT / "deploy" / "certs", "--into", self._folder, "revoke", name)

    @staticmethod
    def _run(*command):
        result = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
        if result.returncode != 0:
            raise Failure(result.stderr.strip().splitlines()[-1] if result.stderr.strip() else f"{command[0]} failed")
        return result.stdout


class Together:
    """`entries` are those of the two trainees and of the instructor."""

    def __init__(self, programs: Path, case: Path, entries, out: Path, say, device, size="1280x720",
                 window=False):
        self.programs, self.case, self.out, self.say, self.device, self.size = programs, case, out, say, device, size
        self.entries = dict(zip((*TRAINEES, INSTRUCTOR), entries))
        self.window = window
        self.started = time.monotonic()
        self.info = case_info(programs, case)

    def run(self):
        (self.out / "logs").mkdir(parents=True, exist_ok=True)
        self.certificates = Certificates(self.programs, self.out)
        with Household(self.out / "logs") as household:
            self.household = household
            screen, self.picture = start_screen(household, self.size, virtual=self.window)
            self.say(f"Picture: {self.picture}.")
            address = self._start_server()
            berg = self.certificates.person(INSTRUCTOR, "instructor")
            viewer = Viewer(household, household.start("osteon-viewer", [
                self.programs / "osteon-viewer", "--server", address, *self.certificates.person(OBSERVER, "observer"),
                "--name", "The class", "--room", ROOM,
                "--size", self.size, "--script", "-", "--summary", self.out / "viewer.json"], screen, takes_input=True))
            console = Console(household, household.start("console", [
                self.programs / "osteon-viewer", "--console", "--server", address, *berg,
                "--name", "Dr. Berg", "--room", ROOM], takes_input=True), self.say)
            self.watcher = self._start_window(address)
            viewer.wait_for_surface()
            viewer.do(self._from_side(0.0))
            viewer.do(f"screenshot {self.out / 'before.png'}")
            self._work(address, viewer, console, berg)
            status = console.do("status")
            self._child("console").may_end = True
            self._child("console").say("quit")
            viewer.do(self._from_side(0.0))
            viewer.do(f"screenshot {self.out / 'after.png'}")
            viewer.finish(self.out / "viewer_status.json")
            codes = self._end_all()
        return self._numbers(codes, status)

    def _child(self, name):
        return next(child for child in self.household.children if child.name == name)

    def _start_server(self):
        address_file = self.out / "logs" / "address"
        address_file.unlink(missing_ok=True)
        self.journal = self.out / f"{ROOM}.journal"
        self.household.start("osteon-server", [
            self.programs / "osteon-server", "--case", self.case, "--listen", "127.0.0.1:0", *self.certificates.server,
            "--address-file", address_file, "--summary", self.out / "server.json", "--journal", self.journal])
        address = self.household.wait_for_file(address_file, "osteon-server", patience_s=60.0)
        self.say(f"Server: {self.case.name} at {address}, by mutual TLS.")
        return address

    def _start_window(self, address):
        guest = self.certificates.person(GUEST, "observer") if self.window else []
        return Watcher(self.household, self.programs, address, [*guest, "--name", "A guest", "--room", ROOM], self.say,
                       self.window)

    def _start_hand(self, address, name, credentials, plan):
        (self.out / f"{name}-plan.json").write_text(json.dumps(plan, indent=2) + "\n", encoding="utf-8")
        cache = ROOT / "build" / "case-cache"
        cache.mkdir(parents=True, exist_ok=True)
        return self.household.start(name, [
            self.programs / "osteon-haptic", "--server", address, *credentials, "--room", ROOM, "--name", name,
            "--plan", self.out / f"{name}-plan.json", "--device", self.device,
            "--session-log", self.out / f"{name}.csv", "--record", self.out / f"{name}.h5",
            "--cut-log", self.out / f"{name}-cuts.csv", "--summary", self.out / f"{name}.json",
            "--cache", cache])

    def _from_side(self, turn):
        """The camera command for the whole bone, from above the work of both."""
        sides = [unit(plans.outward(self.entries[name])) for name in TRAINEES]
        side = unit(sides[0] + sides[1] + np.array([turn, -0.5, 0.2]))
        up = np.array([0.0, -1.0, 0.0]) if abs(side[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
        return look_at_all(self.info["bounds_mm"], side, up)

    def _wait(self, what, holds, patience_s=PATIENCE_S):
        deadline = time.monotonic() + patience_s
        while not holds():
            self.household.check()
            self.watcher.check()
            if time.monotonic() > deadline:
                raise Failure(f"{what} did not happen within {patience_s:.0f} s")
            time.sleep(0.2)

    def _cuts(self, console, name):
        hand = console.hands().get(name)
        return hand.cuts if hand else 0

    def _work(self, address, viewer, console, berg):
        hands = {}
        for name, role in TRAINEES.items():
            hands[name] = self._start_hand(address, name, self.certificates.person(name, role),
                                           plans.window(self.entries[name], [18, 12], then_s=STAYS_S))
            hands[name].may_end = True
        self._wait("that both surgeons cut", lambda: all(self._cuts(console, name) > 100 for name in TRAINEES), 120.0)
        console.do("say all I am watching you both")
        viewer.do("look tool 90")
        viewer.do(f"screenshot {self.out / 'both.png'}")
        console.do("mark both at work")
        time.sleep(3.0)

        console.do("freeze anna Stop there, I will show you")
        console.do("wait acknowledged anna")
        frozen = self._cuts(console, "anna")
        time.sleep(2.0)
        console.do("take anna")
        hands["berg"] = self._start_hand(address, INSTRUCTOR, berg,
                                         plans.window(self.entries[INSTRUCTOR], [8, 6], then_s=0.5))
        hands["berg"].may_end = True
        self._wait("that the instructor's hand cuts", lambda: self._cuts(console, INSTRUCTOR) > 20, 120.0)
        console.do(f"guide anna along {console.hands()[INSTRUCTOR].number} share 0.6")
        viewer.do("look tool 90")
        viewer.do(f"screenshot {self.out / 'guided.png'}")
        self._wait("that the instructor's hand has drilled", lambda: hands["berg"].exit_code is not None, 120.0)
        console.do("unguide anna")
        self.cuts_while_frozen = self._cuts(console, "anna") - frozen
        shown = console.hands()[INSTRUCTOR]
        console.do(f"undo {shown.cuts} of {shown.number}")
        time.sleep(1.0)
        console.do("give-back anna")
        console.do("free anna")
        console.do("wait acknowledged anna")
        console.do("say anna go on, a little less deep")
        for name in TRAINEES:
            self._wait(f"that {name} is done", lambda hand=hands[name]: hand.exit_code is not None, 240.0)
        for name, hand in hands.items():
            if hand.exit_code not in (0, 1):  # 1: a stopped step was not completed
                raise self.household.died(hand)
        time.sleep(0.5)

    def _end_all(self):
        codes = {}
        for name in ("anna", "ben", "berg", "console", "osteon-viewer", "osteon-server"):
            child = self._child(name)
            if name == "osteon-server":
                self.watcher.wait_until_closed()
            codes[name] = child.wait(20.0) if child.may_end else None
            if codes[name] is None:
                codes[name] = child.end()
            child.may_end = True
            if codes[name] != 0 and name not in ("anna", "ben", "berg"):
                raise self.household.died(child)
        return codes

    def _numbers(self, codes, status):
        server = record.read_json(self.out / "server.json")
        hands = {name: record.read_json(self.out / f"{name}.json") for name in ("anna", "ben", "berg")}
        events = self._events()
        numbers = {
            "device": self.device, "picture": self.picture, "machine": record.machine(), "case": self.info,
            "exit_codes": codes,
            "field_hash_server": server.get("field_hash"),
            "field_hashes": {name: hands[name].get("field_hash") for name in TRAINEES},
            "field_hash_console": next((word for word in status.split() if len(word) == 64), None),
            "mesh_hash_server": server.get("mesh_hash"),
            "mesh_hash_viewer": record.read_json(self.out / "viewer_status.json").get("scene_mesh_hash"),
            "cuts_while_frozen": self.cuts_while_frozen,
            "journal": check_journal(self.programs, self.journal, self.case),
            "events": events,
            "forces": {name: recorded_steps(self.out / f"{name}.h5") for name in hands},
            "hands": hands,
        }
        held = [numbers["field_hash_server"], numbers["journal"]["field_hash"], *numbers["field_hashes"].values()]
        if numbers["field_hash_console"]:
            held.append(numbers["field_hash_console"])
        numbers["one_bone"] = (None not in held and len(set(held)) == 1
                               and numbers["mesh_hash_server"] == numbers["mesh_hash_viewer"])
        (self.out / "session.json").write_text(json.dumps(numbers, indent=2, ensure_ascii=False) + "\n",
                                               encoding="utf-8")
        return numbers

    def _events(self):
        """All events of the journal as (seconds, who, what). Cuts are only counted."""
        server, exported = self.programs / "osteon-server", self.out / f"{ROOM}.jsonl"
        subprocess.run([server, "export", self.journal, exported], capture_output=True, check=True)
        people = subprocess.run([server, "people", self.journal], capture_output=True, text=True, check=True).stdout
        with open(exported, encoding="utf-8") as lines:
            return described(map(json.loads, lines), names_by_pseudonym(people))


def names_by_pseudonym(listing):
    """Names by number, from lines such as `1  2026-11-22  anna`."""
    parts = (line.split(None, 2) for line in listing.splitlines())
    return {int(part[0]): part[2].strip() for part in parts if len(part) == 3 and part[0].isdigit()}


def described(entries, names):
    """The journal's log entries in words."""
    who, events, cuts = {0: "the room"}, [], {}
    for entry in entries:
        event, at = entry["event"], round(float(entry["at_s"]), 2)
        author = int(event.get("author", 0))
        if "join" in event:
            person = int(event["join"].get("person", 0))
            author = int(event["join"]["author"])
            who[author] = names.get(person, f"#{author}")
            events.append((at, who[author], "comes in"))
        elif "cut" in event:
            author = int(event["cut"]["author"])
            cuts[author] = cuts.get(author, 0) + 1
        elif "supervision" in event:
            subject = who.get(int(event["supervision"]["subject"]), "?")
            events.append((at, who.get(author, "?"),
                           f"{subject}: {decided(event['supervision'].get('supervision', {}), who)}"))
        elif "words" in event:
            to = who.get(int(event["words"].get("to", 0)), "all") if int(event["words"].get("to", 0)) else "all"
            events.append((at, who.get(author, "?"), f"to {to}: “{event['words']['words']}”"))
        elif "undo" in event:
            events.append((at, who.get(author, "?"), f"takes back {len(event['undo'].get('room_seqs', []))} events"))
        elif "mark" in event:
            events.append((at, who.get(author, "?"), f"marks “{event['mark']['label']}”"))
    return {"events": events, "cuts": {who.get(author, f"#{author}"): count for author, count in cuts.items()}}


def decided(what, who):
    words = []
    if what.get("stopped"):
        words.append("stopped")
    if int(what.get("taken_by", 0)):
        words.append("tool taken")
    if int(what.get("guide", 0)):
        words.append(f"guided along {who.get(int(what['guide']), '?')}, share {what.get('guide_share', 0) / 1000:g}")
    if what.get("words"):
        words.append(f"“{what['words']}”")
    return ", ".join(words) or "free"


def force_steps(force_n, handle_mm, mono_ns, stiffness_n_per_mm):
    """The growth of the force on a hand (three components) from row to row, and the part of it that is not explained.

    The hand's own motion and the slew limit explain growth: the spring and its damping each follow a moving handle, and
    all other force grows by at most the limit.
    """
    now, wanted = force_n[:-1], force_n[1:]
    # Force may fall at once. So growth is the distance from the nearest fraction of the present force.
    square = np.sum(now * now, axis=1)
    part = np.clip(np.sum(wanted * now, axis=1) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    growth = np.linalg.norm(wanted - part[:, None] * now, axis=1)
    by_hand = 2.0 * stiffness_n_per_mm * np.linalg.norm(np.diff(handle_mm, axis=0), axis=1)
    # A late tick, or the one after it, counts for all periods that have passed.
    apart_ms = np.diff(mono_ns) / 1e6
    late = np.abs(apart_ms - 1.0) > 0.3
    late[1:] |= late[:-1].copy()
    periods = np.where(late, np.ceil(apart_ms) + 1.0, 1.0)
    beyond = growth - by_hand - SLEW_N_PER_MS * periods
    return {"rows": len(force_n), "most_n": round(float(np.linalg.norm(force_n, axis=1).max(initial=0.0)), 2),
            "most_growth_n_per_ms": round(float(growth.max(initial=0.0)), 3),
            "most_beyond_slew_n": round(max(0.0, float(beyond.max(initial=0.0))), 4),
            "steps_beyond_slew": int(np.sum(beyond > ROUNDING_N))}


def recorded_steps(file: Path):
    """The same for a hand's recording. The motor's vibration, drag and kick belong to the tool and are left out."""
    if not file.exists():
        raise Failure(f"{file.name} was not written, although the session ended")
    with h5py.File(file, "r") as rows:
        count = len(rows["data/time"])
        about = rows["metadata"].attrs
        scale = float(np.min(rows["burr_change/scale"][:], initial=1.0))
        stiffness = min(float(about["force_scale"]) * COUPLING_N_PER_MM,
                        float(about["device_stiffness_n_per_mm"]) / scale)
        force = (rows["drill_force_feedback/wrench"][:count, :3].astype(float)
                 - rows["drill_force_feedback/motor_force"][:count])
        handle_mm = rows["high_frequency_poses/device_pose/pose"][:count, :3]
        names = [name.decode() for name in rows["metadata/event_bits"][:]]
        led = led_mm(rows["data/events"][:count].astype(np.int64), names, handle_mm)
        return {**force_steps(force, handle_mm, rows["data/mono_ns"][:count], stiffness), "led_mm": led}


def led_mm(events, names, handle_mm):
    """The largest distance that a handle moved under guidance, from its position at the start of the guidance."""
    led = (events >> names.index("hand guided")) & 1
    edges = np.flatnonzero(np.diff(np.concatenate(([0], led, [0]))))
    return round(max((float(np.linalg.norm(handle_mm[begin:end] - handle_mm[begin], axis=1).max())
                      for begin, end in zip(edges[::2], edges[1::2])), default=0.0), 2)


def is_gentle(forces):
    """Whether every hand was recorded, and felt no step beyond the slew limit."""
    return all(force["rows"] > 1000 and force["steps_beyond_slew"] == 0 for force in forces.values())


def plot(out: Path, numbers, file: Path):
    """Each hand's rendered force over time, with what the instructor did."""
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(3, 1, sharex=True, figsize=(12, 7), constrained_layout=True)
    starts = {name: record.read_table(out / f"{name}.csv") for name in ("anna", "ben", "berg")}
    first = min(int(table["mono_ns"][0]) for table in starts.values() if len(table["mono_ns"]))
    for axis, (name, table) in zip(axes, starts.items()):
        rows = plots.thinned({"time_s": (table["mono_ns"] - first) / 1e9, "force": table["force_rendered_n"],
                              "cutting": table["phase"] == "cutting"})
        axis.plot(rows["time_s"], rows["force"], color=plots.STEEL, lw=0.8)
        axis.fill_between(rows["time_s"], 0, 1, where=rows["cutting"], transform=axis.get_xaxis_transform(),
                          color=plots.BONE, alpha=0.15, lw=0)
        axis.set_ylabel(f"{name}\nforce on the hand, N")
    axes[-1].set_xlabel("time, s (shaded: cutting)")
    figure.savefig(file, dpi=110)
    plt.close(figure)


def write_report(out: Path, numbers, title):
    plot(out, numbers, out / "forces.png")
    journal, log = numbers["journal"], numbers["events"]
    rows = "".join(f"<tr><td class=n>{at:.2f}</td><td>{html.escape(who)}</td><td>{html.escape(what)}</td></tr>"
                   for at, who, what in log["events"])
    hands = "".join(f"<tr><td>{html.escape(name)}</td><td class=n>{log['cuts'].get(name, 0)}</td>"
                    f"<td class=n>{force['most_n']:.2f}</td><td class=n>{force['most_growth_n_per_ms']:.3f}</td>"
                    f"<td class=n>{force['steps_beyond_slew']}</td><td class=n>{force['led_mm']:.1f}</td></tr>"
                    for name, force in numbers["forces"].items())
    facts = [
        report.fact("one bone" if numbers["one_bone"] else "DIFFERENT bones",
                    "in server, hands, viewer, console and journal at the end (hashes)"),
        report.fact(numbers["cuts_while_frozen"], "accepted cuts of the stopped hand"),
        report.fact(sum(force["steps_beyond_slew"] for force in numbers["forces"].values()),
                    f"steps of force on the three hands beyond {SLEW_N_PER_MS:g} N in a millisecond that no movement "
                    "of the hand explains"),
        report.fact(journal["events"], "events in the room's journal"),
    ]
    page = f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{html.escape(title)} – together</title><style>{report.STYLE}</style></head><body><main>
<h1>{html.escape(title)}: two surgeons and their instructor</h1>
<p class=lead>Anna and Ben, trainees, work on one bone. Dr. Berg watches, stops Anna, takes her tool, and guides
her hand along his own. He undoes what his hand has cut and gives everything back. Every program is a process of its
own; they prove who they are by certificates and tickets.</p>
<span class=badge>simulated devices: no person and no haptic hardware took part</span>
<div class=facts>{''.join(facts)}</div>
<h2>Before and after</h2>
<div class=pair>{report.picture(out, 'before.png', 'Before')}{report.picture(out, 'after.png', 'After')}</div>
<div class=pair>{report.picture(out, 'both.png', 'Both at work')}
{report.picture(out, 'guided.png', 'The instructor shows it')}</div>
<h2>Who did what when</h2>
<p>From the room's journal, in seconds since the room was made. Cuts are left out here and counted below.</p>
<div class=scroll><table><tr><th class=n>s</th><th>who</th><th>what</th></tr>{rows}</table></div>
<h2>What the hands felt</h2>
<p>Force that no hand causes grows by at most {SLEW_N_PER_MS:g} N in a millisecond. A hand that moves into bone may
raise it faster.</p>
{report.picture(out, 'forces.png', 'Force on each hand over time', wide=True)}
<table><tr><th>hand</th><th class=n>cuts</th><th class=n>largest force, N</th><th class=n>largest growth in 1 ms, N</th>
<th class=n>steps beyond the limit</th><th class=n>motion of the handle under guidance, mm</th></tr>{hands}</table>
<p class=lead>All numbers are in <a href="session.json">session.json</a>.</p>
</main></body></html>
"""
    (out / "report.html").write_text(page, encoding="utf-8")


def run(programs, case, entries, out, say, device, title, window):
    numbers = Together(programs, case, entries, out, say, device, window=window).run()
    say("Writing the report")
    write_report(out, numbers, title)
    for at, who, what in numbers["events"]["events"]:
        say(f"{at:8.2f} s  {who}: {what}")
    say(f"Accepted cuts of the stopped hand: {numbers['cuts_while_frozen']} (simulated hands)")
    say("Server, hands, viewer, console and journal have "
        + ("the same bone" if numbers["one_bone"] else "DIFFERENT bones") + " at the end.")
    for name, force in numbers["forces"].items():
        say(f"{name} felt at most {force['most_n']:.1f} N; {force['steps_beyond_slew']} of {force['rows']} steps in a "
            f"millisecond were larger than the hand's movement and the slew limit allow, "
            f"by {force['most_beyond_slew_n']:.3f} N at most"
            + (f"; under guidance it moved {force['led_mm']:.1f} mm" if force["led_mm"] > 0.0 else ""))
    say(f"Report: {out / 'report.html'}")
    return 0 if numbers["one_bone"] and numbers["cuts_while_frozen"] == 0 and is_gentle(numbers["forces"]) else 1
