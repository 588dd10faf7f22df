"""Runs one session of all programs on this machine: starts them, runs the simulated surgeon, ends them in order."""
import json
import subprocess
import time
from pathlib import Path

import numpy as np

import plans
import record
from processes import Failure, Household, has_sound_server
from screen import Watcher, start_screen

ROOT = Path(__file__).resolve().parents[2]
SURFACE_PATIENCE_S = 120.0
QUIET_PATIENCE_S = 60.0


class Viewer:
    """osteon-viewer, controlled line by line over its standard input."""

    def __init__(self, household, child):
        self._household, self._child = household, child

    def do(self, command, patience_s=30.0):
        self._child.say(command)
        deadline = time.monotonic() + patience_s
        answer = None
        while answer is None:
            answer = self._child.next_line(0.2)
            if answer is None:
                self._household.check()
                if time.monotonic() > deadline:
                    raise Failure(f"osteon-viewer did not answer '{command}' within {patience_s:.0f} s; "
                                  "its last lines:", self._child.last_words())
        if not answer.startswith("ok"):
            raise Failure(f"osteon-viewer could not '{command}': {answer}")
        return answer

    def wait_for_surface(self):
        self.do("wait surface", SURFACE_PATIENCE_S)

    def finish(self, status_file):
        self.do(f"status {status_file}")
        self._child.may_end = True
        self.do("quit")


class Session:
    """One session. `say` gets its live status. Results are in `out`. With `window` the window `osteon` on the caller's
    display shows the work, and the pictures come from a virtual screen."""

    def __init__(self, programs: Path, case: Path, plan, out: Path, say=print, pictures=True, late_viewer=False,
                 device="simulated", size="1280x720", window=False):
        self.programs, self.case, self.plan, self.out, self.say = programs, case, plan, out, say
        self.pictures, self.late_viewer, self.device, self.size = pictures, late_viewer, device, size
        self.window = window
        self.started = time.monotonic()
        self.info = case_info(programs, case)

    def run(self):
        """Runs the session and returns its numbers. Raises Failure."""
        self.out.mkdir(parents=True, exist_ok=True)
        plan_file = self.out / "plan.json"
        plan_file.write_text(json.dumps(self.plan, indent=2) + "\n", encoding="utf-8")
        with Household(self.out / "logs") as household:
            self.household = household
            self.screen, self.picture = start_screen(household, self.size, virtual=self.window)
            self.say(f"Picture: {self.picture}.")
            address = self._start_server()
            viewer = self._start_viewer(address, "osteon-viewer", "--frame-log", self.out / "frames.csv",
                                        "--summary", self.out / "viewer.json")
            self.watcher = Watcher(household, self.programs, address, ["--plain"], self.say, self.window)
            self._start_audio(address)
            viewer.wait_for_surface()
            if self.pictures:
                viewer.do(self._overview())
                viewer.do(f"screenshot {self.out / 'before.png'}")
            self._work(viewer, address, plan_file)
            self._last_pictures(viewer)
            if self.late_viewer:
                late = self._start_viewer(address, "late viewer")
                late.wait_for_surface()
                late.finish(self.out / "late_viewer_status.json")
            viewer.finish(self.out / "viewer_status.json")
            codes = self._end_all()
        return self._numbers(codes)

    def _start_server(self):
        address_file = self.out / "logs" / "address"
        address_file.parent.mkdir(exist_ok=True)
        address_file.unlink(missing_ok=True)
        self.household.start("osteon-server", [
            self.programs / "osteon-server", "--case", self.case, "--listen", "127.0.0.1:0", "--plain",
            "--address-file", address_file, "--summary", self.out / "server.json", "--journal", self._new_journal()])
        address = self.household.wait_for_file(address_file, "osteon-server", patience_s=60.0)
        self.say(f"Server: {self.case.name} at {address}.")
        return address

    def _new_journal(self):
        """A new journal. The server would continue an old one from the session before."""
        for file in self.out.glob("session.journal*"):
            file.unlink()
        return self.out / "session.journal"

    def _start_viewer(self, address, name, *options):
        child = self.household.start(name, [
            self.programs / "osteon-viewer", "--server", address, "--plain", "--size", self.size, "--script", "-",
            *options], self.screen, takes_input=True)
        return Viewer(self.household, child)

    def _overview(self):
        """The camera command for the whole bone, from the side of the work."""
        entry = next((step["entry"] for step in self.plan["steps"]
                      if {"toward", "axis"} & step.get("entry", {}).keys()), None)
        if entry is None:
            return "look overview"
        # Slightly from the front, so that the bone is easy to recognise.
        eye_side = unit(unit(plans.outward(entry)) + np.array([0.0, -0.75, -0.15]))
        up = np.array([0.0, 0.0, 1.0]) if abs(eye_side[2]) < 0.95 else np.array([0.0, -1.0, 0.0])
        return look_at_all(self.info["bounds_mm"], eye_side, up)

    def _start_audio(self, address):
        command = [self.programs / "osteon-audio", "--server", address, "--plain", "--wav", self.out / "sound.wav",
                   "--overwrite", "--state-log", self.out / "states.csv", "--summary", self.out / "audio.json",
                   "--output", "pulse"]
        if has_sound_server():
            self.say("Sound: your sound server.")
        else:
            command = [ROOT / "deploy/with-null-sink", *command]
            self.say("Sound: a PulseAudio sink without a card, since no sound server answers; it is recorded.")
        self.household.start("osteon-audio", command)

    def _work(self, viewer, address, plan_file):
        """The surgeon's work. Prints a status line every second; the camera follows the tool."""
        cache = ROOT / "build" / "case-cache"
        cache.mkdir(parents=True, exist_ok=True)
        # osteon-haptic overwrites no recording. This one is of the session before, unless it is to be played now.
        if str(self.out / "session.h5") not in self.device:
            (self.out / "session.h5").unlink(missing_ok=True)
        haptic = self.household.start("osteon-haptic", [
            self.programs / "osteon-haptic", "--server", address, "--plain", "--plan", plan_file,
            "--device", self.device, "--session-log", self.out / "session.csv",
            "--record", self.out / "session.h5", "--cut-log", self.out / "cuts.csv",
            "--summary", self.out / "haptic.json", "--cache", cache, "--status"])
        haptic.may_end = True
        began = time.monotonic()
        cutting_lines, photographed = 0, False
        while haptic.exit_code is None:
            self.household.check()
            self.watcher.check()
            lines = haptic.new_lines()
            for line in lines:
                self.say(f"{time.monotonic() - self.started:5.0f} s  {line}")
                cutting_lines += "cutting" in line
            if self.pictures and lines and cutting_lines > 0:
                viewer.do("look tool 70")
            if self.pictures and cutting_lines >= 2 and not photographed:
                viewer.do(f"screenshot {self.out / 'during.png'}")
                photographed = True
            time.sleep(0.1)
        for line in haptic.new_lines():
            self.say(f"{time.monotonic() - self.started:5.0f} s  {line}")
        if haptic.exit_code != 0:
            raise self.household.died(haptic)
        self.worked_s = time.monotonic() - began
        if self.pictures and not photographed:
            viewer.do(f"screenshot {self.out / 'during.png'}")

    def _last_pictures(self, viewer):
        cuts = record.read_table(self.out / "cuts.csv")
        if len(cuts["room_seq"]) > 0:
            viewer.do(f"wait seq {int(cuts['room_seq'].max())}", QUIET_PATIENCE_S)
        if not self.pictures:
            return
        viewer.do("tool off")
        steps = [step for step in record.read_json(self.out / "haptic.json")["steps"] if "entry_mm" in step]
        for step, name in zip(steps, ("hole.png", "window.png")):
            viewer.do(close_up(step))
            viewer.do(f"screenshot {self.out / name}")
        viewer.do(self._overview())
        viewer.do(f"screenshot {self.out / 'after.png'}")

    def _end_all(self):
        """Ends the programs, clients first. Each must end with exit code 0. The window needs the server to its end."""
        codes = {}
        order = ("osteon-haptic", "late viewer", "osteon-viewer", "osteon-audio", "osteon-server")
        children = {child.name: child for child in self.household.children}
        for name in (name for name in order if name in children):
            child = children[name]
            if name == "osteon-server":
                self.watcher.wait_until_closed()
            codes[name] = child.wait(20.0) if child.may_end else None
            if codes[name] is None:
                codes[name] = child.end()
            child.may_end = True
            if codes[name] != 0:
                raise self.household.died(child)
        return codes

    def _numbers(self, codes):
        summaries = {name: record.read_json(self.out / f"{name}.json")
                     for name in ("server", "haptic", "viewer", "audio")}
        statuses = [record.read_json(file) for file in sorted(self.out.glob("*viewer_status.json"))]
        numbers = {
            "device": self.device,
            "machine": record.machine(),
            "picture": self.picture,
            "case": self.info,
            "seconds_of_work": round(self.worked_s, 1),
            "latency_ms": record.latencies(self.out),
            "exit_codes": codes,
            "mesh_hashes": [summaries["server"].get("mesh_hash"),
                            *(status.get("scene_mesh_hash") for status in statuses)],
            "programs": summaries,
            "plan": self.plan,
        }
        numbers["agreement"] = agreement(numbers)
        numbers["journal"] = check_journal(self.programs, self.out / "session.journal", self.case)
        save(numbers, self.out)
        return numbers


def save(numbers, folder):
    (folder / "session.json").write_text(json.dumps(numbers, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def unit(vector):
    return vector / max(1e-9, float(np.linalg.norm(vector)))


def look(target, eye, up):
    return "look at {} from {} up {}".format(*(" ".join(f"{v:.3f}" for v in point) for point in (target, eye, up)))


def look_at_all(box, eye_side, up):
    """The camera command for a whole box of bone in mm, seen from a side. `eye_side` and `up` are unit vectors."""
    low, high = np.array(box["min"]), np.array(box["max"])
    # The viewer shows 0.54 of the distance as height. A long bone needs all of it, a skull is wider than high.
    distance = max(1.42 * float(np.linalg.norm(high - low)), 2.1 * float(np.abs(up) @ (high - low)))
    centre = 0.5 * (low + high)
    return look(centre, centre + distance * eye_side, up)


def close_up(step):
    """The camera command for a step's site from outside, slightly from the side, so that its walls are visible."""
    axis, target = unit(np.array(step["axis"])), np.array(step["entry_mm"])
    aside = np.cross(axis, [0.0, 0.0, 1.0])
    aside = unit(aside) if np.linalg.norm(aside) > 0.1 else np.array([1.0, 0.0, 0.0])
    return look(target, target - 36.0 * axis + 16.0 * aside, np.cross(aside, axis))


def check_journal(programs, journal, case):
    """The result of osteon-server verify for a journal that no server has open, and of the replayed bone."""
    result = subprocess.run([programs / "osteon-server", "verify", journal, "--case", case,
                             "--key", journal.parent / "signing.key"], capture_output=True, text=True, check=False)
    said = dict(line.split(":", 1) for line in result.stdout.splitlines() if ":" in line)
    return {"sound": result.returncode == 0 and said.get("verdict", "").strip() == "sound",
            "field_hash": said.get("field hash", "").strip(),
            "events": said.get("events", "").split(",")[0].strip(),
            "bytes": sum(file.stat().st_size for file in journal.parent.glob(journal.name + "*"))}


def case_info(programs, case):
    """The case's description. Failure with the importer's sentence if the case cannot be read."""
    result = subprocess.run([programs / "osteon-import", "info", case, "--json"], capture_output=True, text=True,
                            check=False)
    if result.returncode != 0:
        raise Failure(result.stderr.strip().splitlines()[-1] if result.stderr.strip() else f"cannot read {case}")
    return json.loads(result.stdout)


def agreement(numbers):
    """Whether all programs had the same bone at the end, from their summaries."""
    programs, meshes = numbers["programs"], numbers["mesh_hashes"]
    server, haptic = programs["server"].get("field_hash"), programs["haptic"].get("field_hash")
    return {
        "field_hash_server": server,
        "field_hash_haptic": haptic,
        "field_hash_equal": bool(server) and server == haptic,
        # Viewers whose surface differs from the server's; they saw every change, or joined late.
        "mesh_differences": sum(mesh != meshes[0] for mesh in meshes),
    }
