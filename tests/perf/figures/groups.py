"""Produces the values of the registry: each group runs once and gives {figure: (value, baseline)}."""
import json
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import devices
import feel
import filters
import haptics
import hours
import imaging_page
import imports
import kernels
import laws
import registry
import rooms
import sounds
import viewing

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "deploy/session"))

import authentication  # noqa: E402  (they, too, use what is found through the path above)
import insiders  # noqa: E402
import plans  # noqa: E402
import record  # noqa: E402
from processes import Failure  # noqa: E402
from session import Session  # noqa: E402

# The phantom of the reference simulations: thickness mm, density g/cm3.
LAYERS = [(5.0, 1.9), (20.0, 0.3), (5.0, 1.9)]
THICKNESS_MM = sum(thickness for thickness, _ in LAYERS)
DRILL_RADIUS_MM = 1.6
POINT_HEIGHT_MM = DRILL_RADIUS_MM / np.tan(np.radians(118 / 2))
RPM = 1000.0
MESH_PERIOD_MS = 1000.0 / 30.0
# Plunges and feed ratio of the reference simulation of the hands.
REFERENCE_PLUNGE_MM = {"expert": 6.0, "novice": 14.4}
REFERENCE_FEED_RATIO = 10.7 / 0.89


def chi_force_n(feed_mm_per_s, density_g_cm3):
    """Chi's law, equation 7.3, at the phantom's spindle speed."""
    return 134.6 * RPM ** -0.3327 * feed_mm_per_s ** 0.5189 * density_g_cm3 ** 1.1841


def error_percent(value, expected):
    return 100.0 * abs(value - expected) / abs(expected)


@dataclass
class Run:
    """One run of deploy/figures. Holds what several groups need."""
    programs: Path
    folder: Path
    soak: bool
    say: object
    sessions: list = field(default_factory=list)   # numbers of all sessions so far
    plunges: dict = field(default_factory=dict)
    tables: list = field(default_factory=list)     # (title, rows) printed beside the figures
    skipped: dict = field(default_factory=dict)    # what was left out: name or its beginning, and reason
    _loop: dict = None

    def empty_loop(self):
        if self._loop is None:
            self.say("empty 1 kHz loop")
            self._loop = json.loads(self.output("osteon-empty-loop", 60 if self.soak else 10))
        return self._loop

    def output(self, program, *arguments, progress=False):
        """Output of a program. `progress`: the user sees its messages during the run."""
        command = [self.programs / program, *map(str, arguments)]
        try:
            result = subprocess.run(command, stdout=subprocess.PIPE, stderr=None if progress else subprocess.PIPE,
                                    text=True, check=False)
        except FileNotFoundError as missing:
            raise Failure(f"{program} is not built; deploy/build perf figure_programs builds it") from missing
        if result.returncode != 0:
            raise Failure(f"{program} ended with {result.returncode}: {(result.stderr or '').strip()[-400:]}")
        return result.stdout

    def outcome(self, program, *arguments):
        """Output and exit code of a program, if an exit code other than 0 is also a result."""
        result = subprocess.run([self.programs / program, *map(str, arguments)], capture_output=True, text=True,
                                check=False)
        if not result.stdout:
            raise Failure(f"{program} ended with {result.returncode} and says nothing: {result.stderr.strip()[-400:]}")
        return result.stdout, result.returncode

    def phantom(self):
        case = self.folder / "phantom"
        if not (case / "case.json").exists():
            self.say("phantom")
            layers = ",".join(f"{thickness:g}:{density:g}" for thickness, density in LAYERS)
            self.output("osteon-import", "phantom", "block", "--layers", layers, "--out", case)
        return case

    def skip(self, name, reason):
        self.skipped[name] = reason
        self.say(f"{name} is SKIPPED: {reason}")

    @staticmethod
    def shared_data(name):
        """A folder of data that may lie beside the checkout or beside a folder above it."""
        found = [parent.parent / "shared/data" / name for parent in (ROOT, *ROOT.parents[:-1])]
        return next((folder for folder in found if folder.is_dir()), None)

    @staticmethod
    def example(name):
        """A file of Debian's invesalius-examples: installed, or unpacked by deploy/install."""
        inside = Path("usr/share/doc/invesalius-examples/examples") / name
        return next((root / inside for root in (Path("/"), ROOT / "build/examples") if (root / inside).is_file()), None)

    def session(self, name, plan, case=None):
        self.say(f"session: {name}")
        folder = self.folder / name
        numbers = Session(self.programs, case or self.phantom(), plan, folder, self.say_in_session, pictures=False,
                          late_viewer=True, size="640x480").run()
        self.sessions.append(numbers)
        return folder, numbers

    def say_in_session(self, line):
        if line.startswith(" "):
            self.say(line)


# Depths of the tip, mm, between which the whole cone is in the near cortex, the medulla, the far cortex.
INSIDE = {"near cortex": (1.5, 4.8), "medulla": (6.5, 24.5), "far cortex": (26.5, 29.5)}


def inside(session, layer):
    """Rows of the log while the whole cone is in a layer, on the way in."""
    low, high = INSIDE[layer]
    depth = session["depth_mm"]
    advancing = depth >= np.maximum.accumulate(depth)
    return advancing & (depth >= low) & (depth <= high)


def loop_figures(run, numbers):
    loop, haptic = run.empty_loop(), numbers["programs"]["haptic"]["loop"]
    patches = numbers["programs"]["haptic"]["patches"]
    return {
        "patch_build_p50": (patches["p50_us"], None),
        "patch_build_p99": (patches["p99_us"], None),
        "haptic_work_p50": (haptic["work_p50_us"], loop["work_p50_us"]),
        "haptic_work_p99": (haptic["work_p99_us"], loop["work_p99_us"]),
        "haptic_late_p50": (haptic["late_p50_us"], loop["late_p50_us"]),
        "haptic_late_p99": (haptic["late_p99_us"], loop["late_p99_us"]),
        "haptic_missed_ticks": (1e4 * haptic["missed"] / max(1, haptic["ticks"]),
                                1e4 * loop["missed"] / max(1, loop["ticks"])),
    }


def latency_figures(numbers):
    latency, frame_ms = numbers["latency_ms"], numbers["programs"]["viewer"]["frame_ms"]

    def frames_after_mesh(part):
        """Frames from a cut to its picture, beyond a period of the mesh stream."""
        return (latency["cut_to_picture"][part] - MESH_PERIOD_MS) / frame_ms["p50"], latency["cut_to_picture"][part]
    return {
        "cut_to_picture_frames_p50": frames_after_mesh("p50"),
        "cut_to_picture_frames_p99": frames_after_mesh("p99"),
        "rig_frame_p50": (frame_ms["p50"], frame_ms["p99"]),
        "cut_to_commit_p50": (latency["cut_to_commit"]["p50"], None),
        "mesh_update_p50": (latency["cut_to_mesh"]["p50"], MESH_PERIOD_MS),
        "mesh_update_p99": (latency["cut_to_mesh"]["p99"], MESH_PERIOD_MS),
        "cut_to_picture_p50": (latency["cut_to_picture"]["p50"], MESH_PERIOD_MS),
        "cut_to_picture_p99": (latency["cut_to_picture"]["p99"], MESH_PERIOD_MS),
        "cut_to_sound_p50": (latency["cut_to_sound"]["p50"], None),
        "cut_to_sound_p99": (latency["cut_to_sound"]["p99"], None),
    }


def over_sessions(sessions):
    """Combines several sessions' figures: the worst value for a figure with a bound, otherwise the median."""
    targets = {figure.name: figure.target for figure in registry.FIGURES}
    combined = {}
    for name in sessions[0]:
        pairs = [figures[name] for figures in sessions]
        missing = [pair for pair in pairs if pair[0] is None]
        if missing:
            combined[name] = missing[0]
            continue
        rising = sorted(pairs, key=lambda pair: pair[0])
        target = targets[name]
        place = len(rising) // 2 if target is None else 0 if target[0] == ">=" else -1
        combined[name] = rising[place]
    return combined


def rig(run):
    """Drills with the feed rig through the phantom, with all programs running. In a soak, several times."""
    sessions = []
    for repetition in range(5 if run.soak else 1):
        folder, numbers = run.session(f"rig-{repetition + 1}", plans.drill("rig", feed_mm_per_s=1.0, beyond_mm=5))
        sessions.append({**loop_figures(run, numbers), **latency_figures(numbers), **rig_physics(folder, numbers)})
    values = over_sessions(sessions)
    values["field_hash_differences"] = (sum(not s["agreement"]["field_hash_equal"] for s in run.sessions), None)
    values["mesh_hash_differences"] = (sum(s["agreement"]["mesh_differences"] for s in run.sessions), None)
    return values


def rig_physics(folder, numbers):
    session = record.read_table(folder / "session.csv")
    force = session["force_physical_n"]
    cortical, medullary = chi_force_n(1.0, 1.9), chi_force_n(1.0, 0.3)
    measured = {layer: float(np.mean(force[inside(session, layer)])) for layer in INSIDE}
    gone = session["depth_mm"] > THICKNESS_MM + POINT_HEIGHT_MM + 1.0
    removed = numbers["programs"]["server"]["removed_mm3"]
    cylinder = np.pi * DRILL_RADIUS_MM ** 2 * THICKNESS_MM
    return {
        "rig_force_cortical_error": (
            max(error_percent(measured[layer], cortical) for layer in ("near cortex", "far cortex")), None),
        "rig_force_medullary_error": (error_percent(measured["medulla"], medullary), None),
        "rig_force_after_exit": (float(np.max(np.abs(force[gone]))) if gone.any() else None, None),
        "rig_removed_volume_error": (error_percent(removed, cylinder), None),
    }


def hand(run, who):
    """Drills with one hand through the phantom: its feeds and its plunge behind the far cortex."""
    folder, _ = run.session(who, plans.drill(who))
    session = record.read_table(folder / "session.csv")
    feeds = {layer: float(np.mean(session["feed_mm_per_s"][inside(session, layer)])) for layer in INSIDE}
    plunge = float(np.max(session["depth_mm"])) - THICKNESS_MM
    run.plunges[who] = plunge
    return feeds, plunge


def expert(run):
    feeds, plunge = hand(run, "expert")
    return {
        "feed_medullary_over_cortical": (feeds["medulla"] / feeds["near cortex"], REFERENCE_FEED_RATIO),
        "plunge_expert": (plunge, REFERENCE_PLUNGE_MM["expert"]),
        "plunge_expert_error": (error_percent(plunge, REFERENCE_PLUNGE_MM["expert"]), None),
    }


def novice(run):
    _, plunge = hand(run, "novice")
    if "expert" not in run.plunges:
        hand(run, "expert")
    return {
        "plunge_novice": (plunge, REFERENCE_PLUNGE_MM["novice"]),
        "plunge_novice_error": (error_percent(plunge, REFERENCE_PLUNGE_MM["novice"]), None),
        "plunge_novice_over_expert": (plunge / run.plunges["expert"],
                                      REFERENCE_PLUNGE_MM["novice"] / REFERENCE_PLUNGE_MM["expert"]),
    }


# In the order in which they run. Agreement is counted after every session.
def scan(run):
    """Drills with the feed rig through the same bone, imported from a CT scan of it."""
    folder, numbers = run.session("scan", plans.drill("rig", feed_mm_per_s=1.0, beyond_mm=5), imports.scanned_slab(run))
    physics = rig_physics(folder, numbers)
    forces = ("force_cortical_error", "force_medullary_error")
    return imports.slab_volume(run) | {f"scan_{name}": physics[f"rig_{name}"] for name in forces}


GROUPS = {**kernels.GROUPS, **devices.GROUPS, **authentication.GROUPS, **insiders.GROUPS,
          **feel.GROUPS, **filters.GROUPS, **haptics.GROUPS, **hours.GROUPS, **imaging_page.GROUPS,
          **laws.GROUPS, **rooms.GROUPS, **sounds.GROUPS, **viewing.GROUPS,
          "expert": expert, "novice": novice, "rig": rig, "scan": scan, "real_imports": imports.real_imports,
          "import_accuracy": imports.import_accuracy,
          "phantoms": imports.phantoms,
          "import_cost": imports.import_cost,
          "import_cost_long": imports.import_cost_long,
          "region_growing": imports.region_growing,
          "case_schema": imports.case_schemas}
