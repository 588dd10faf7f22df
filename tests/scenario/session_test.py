"""Tests the session's calculations and clean-up, on which the demo's report and the figures depend."""
import os
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy/session"))

import numpy as np  # noqa: E402  (the path above comes first)

import plans  # noqa: E402
import record  # noqa: E402
import session  # noqa: E402
from processes import Failure, Household  # noqa: E402

MS = 1_000_000


class Latencies(unittest.TestCase):
    def test_a_cut_is_seen_with_the_first_frame_that_contains_it(self):
        cuts = {"room_seq": np.array([1, 2, 3]), "closed_mono_ns": np.array([0, 10, 20]) * MS}
        frames = {"room_seq": np.array([0, 2, 3]), "rendered_mono_ns": np.array([5, 40, 70]) * MS}
        np.testing.assert_allclose(record.after_cut_ms(cuts, frames, "rendered_mono_ns"), [40, 30, 50])

    def test_a_cut_that_no_frame_contains_is_not_counted(self):
        cuts = {"room_seq": np.array([1, 9]), "closed_mono_ns": np.array([0, 10]) * MS}
        frames = {"room_seq": np.array([1]), "rendered_mono_ns": np.array([7]) * MS}
        np.testing.assert_allclose(record.after_cut_ms(cuts, frames, "rendered_mono_ns"), [7])

    def test_a_state_is_timed_from_its_first_row(self):
        rows = {"state_seq": np.array([4, 4, 5]), "mono_ns": np.array([1, 2, 3]) * MS}
        states = {"state_seq": np.array([4, 5, 6]), "sounded_mono_ns": np.array([11, 23, 30]) * MS}
        np.testing.assert_allclose(record.after_state_ms(rows, states, "sounded_mono_ns"), [10, 20])

    def test_nothing_measured_is_not_zero(self):
        self.assertIsNone(record.spread([])["p50"])


def leg(bone, side):
    """Landmarks and axes of a straight bone that leans by 3 : 40 towards its outer side. `side` is 1 for a left one."""
    along, outer = np.array([side * 3.0, 0.0, 40.0]), np.array([side * 30.0, 0.0, 0.0])
    marks = {"femur": {"lateral epicondyle": outer, "medial epicondyle": -outer},
             "tibia": {"knee centre": 10 * along, "ankle centre": 0 * along,
                       "lateral malleolus": outer, "medial malleolus": -outer}}[bone]
    return {"landmarks": [{"name": name, "point_mm": point.tolist()} for name, point in marks.items()],
            "axes": [{"name": "anatomical axis", "point_mm": (5 * along).tolist(),
                      "direction": (along / np.linalg.norm(along)).tolist()}]}


class EntriesOnAShaft(unittest.TestCase):
    def test_lead_across_it_through_its_axis(self):
        for bone, height_mm in (("femur", 200.0), ("tibia", 300.0)):
            along = np.array([3.0, 0.0, 40.0])
            centre = height_mm / 40.0 * along
            entries = plans.on_phantom(leg(bone, 1), bone)
            for entry, apart_mm in zip(entries, (0.0, -plans.APART_MM, plans.APART_MM), strict=True):
                self.assertAlmostEqual(np.linalg.norm(entry["axis"]), 1.0)
                self.assertAlmostEqual(np.dot(entry["axis"], along), 0.0)
                np.testing.assert_allclose(entry["point_mm"], centre + apart_mm * along / np.linalg.norm(along))

    def test_are_lateral_on_a_femur_medial_on_a_tibia_and_in_front(self):
        for bone, sign in (("femur", 1.0), ("tibia", -1.0)):
            for side in (1, -1):
                first, second, third = map(plans.outward, plans.on_phantom(leg(bone, side), bone))
                self.assertGreater(sign * side * first[0], 0.99)
                np.testing.assert_allclose(second, [0.0, -1.0, 0.0], atol=1e-12)
                np.testing.assert_allclose(third, first)

    def test_of_a_right_bone_are_those_of_the_left_one_mirrored(self):
        for bone in ("femur", "tibia"):
            for left, right in zip(plans.on_phantom(leg(bone, 1), bone), plans.on_phantom(leg(bone, -1), bone)):
                for key in ("point_mm", "axis"):
                    np.testing.assert_allclose(np.array(left[key]) * [-1, 1, 1], right[key], atol=1e-9)

    def test_windows_are_longest_along_it(self):
        shaft = plans.on_phantom(leg("femur", 1), "femur")[0]
        for entry, size_mm in ((shaft, [12, 18]), (plans.toward([1, 0, 0]), [18, 12])):
            self.assertEqual(plans.window(entry, [18, 12], 0.5)["steps"][0]["window_mm"], size_mm)


# Landmarks of phantoms in a simple place, mm. Lateral is +x, in front is -y.
MARKS = {
    "patella": {"patellar apex": [0, 0, -20], "patellar base": [0, 0, 20]},
    "pelvis": {f"{side} {place} superior iliac spine": [sign * x, y, 80]
               for side, sign in (("left", 1), ("right", -1)) for place, x, y in (("anterior", 120, -40),
                                                                                  ("posterior", 40, 100))},
    "hip": {"greater trochanter": [140, 10, 0], "head centre": [90, 0, 0],
            "anterior superior iliac spine": [120, -40, 80], "posterior superior iliac spine": [40, 100, 80]},
    "knee": {"lateral epicondyle": [40, 0, 0], "medial epicondyle": [-40, 0, 0], "tibia, knee centre": [0, 0, -25]},
}


class EntriesOnOtherPhantoms(unittest.TestCase):
    def entries(self, bone):
        return plans.on_phantom({"landmarks": [{"name": name, "point_mm": point}
                                               for name, point in MARKS[bone].items()], "axes": []}, bone)

    def test_lead_into_the_bone_from_where_a_surgeon_stands(self):
        for bone, sides in {"patella": [[0, -1, 0]], "pelvis": [[1, 0, 0], [-1, 0, 0], [1, 0, 0]],
                            "hip": [[1, 0.2, 0], [1, 0.2, 0], [1, 0.2, 0]],
                            "knee": [[1, 0, 0], [-1, 0, 0], [1, 0, 0]]}.items():
            for entry, side in zip(self.entries(bone), sides, strict=True):
                np.testing.assert_allclose(plans.outward(entry), np.array(side) / np.linalg.norm(side), atol=1e-9)

    def test_leave_room_for_two_windows(self):
        for bone in ("pelvis", "hip", "knee"):
            places = [np.array(entry["point_mm"]) for entry in self.entries(bone)]
            for i, j in ((0, 1), (0, 2), (1, 2)):
                self.assertGreaterEqual(np.linalg.norm(places[i] - places[j]), plans.APART_MM)


class Overview(unittest.TestCase):
    def test_shows_all_of_a_long_bone(self):
        half_height = np.tan(np.radians(15.0))  # the viewer's camera has an angle of 30 degrees
        for size in ([130.0, 80.0, 430.0], [105.0, 83.0, 400.0]):
            for side in ([1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.8, -0.6, 0.0]):
                box = {"min": [0.0, 0.0, 0.0], "max": size}
                words = session.look_at_all(box, np.array(side), np.array([0.0, 0.0, 1.0])).split()
                eye = np.array(list(map(float, words[6:9])))
                for corner in np.ndindex(2, 2, 2):
                    sight = np.array(corner) * size - eye
                    self.assertLess(abs(sight[2]), half_height * -np.dot(sight, side))


class Tables(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def file(self, name, content):
        path = Path(self.folder.name, name)
        path.write_bytes(content)
        return path

    def test_a_line_cut_short_is_left_out(self):
        table = record.read_table(self.file("a.csv", b"n,x_mm,tool\n1,0.5,drill\n2,1.5,burr\n3,2"))
        self.assertEqual(table["n"].tolist(), [1, 2])
        self.assertEqual(table["x_mm"].tolist(), [0.5, 1.5])
        self.assertEqual(table["tool"].tolist(), ["drill", "burr"])

    def test_missing_and_empty_files_are_named(self):
        with self.assertRaisesRegex(Failure, "cuts.csv"):
            record.read_table(Path(self.folder.name, "cuts.csv"))
        with self.assertRaisesRegex(Failure, "b.json is not JSON"):
            record.read_json(self.file("b.json", b"{"))

    def test_sound_of_every_width_reads_the_same(self):
        wave = np.array([0.0, 0.5, -0.5, 0.25])
        whole = {16: (wave * 2 ** 15).astype("<i2").tobytes(), 32: (wave * 2 ** 31).astype("<i4").tobytes(),
                 24: b"".join(int(x * 2 ** 23).to_bytes(3, "little", signed=True) for x in wave)}
        kinds = [(1, bits, data) for bits, data in whole.items()] + [(3, 32, wave.astype("<f4").tobytes())]
        for kind, bits, data in kinds:
            head = struct.pack("<HHIIHH", kind, 1, 48000, 48000 * bits // 8, bits // 8, bits)
            content = (b"RIFF" + struct.pack("<I", 36 + len(data)) + b"WAVEfmt " + struct.pack("<I", 16) + head +
                       b"data" + struct.pack("<I", len(data)) + data)
            rate, samples = record.read_wav(self.file("s.wav", content))
            self.assertEqual(rate, 48000)
            np.testing.assert_allclose(samples, wave, atol=1e-6)


class Agreement(unittest.TestCase):
    @staticmethod
    def of(server, haptic, meshes):
        return session.agreement({"programs": {"server": {"field_hash": server}, "haptic": {"field_hash": haptic}},
                                  "mesh_hashes": meshes})

    def test_differences_are_seen(self):
        self.assertTrue(self.of("a", "a", ["m", "m"])["field_hash_equal"])
        self.assertFalse(self.of("a", "b", [])["field_hash_equal"])
        self.assertFalse(self.of(None, None, [])["field_hash_equal"])
        self.assertEqual(self.of("a", "a", ["m", "n"])["mesh_differences"], 1)


class Housekeeping(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def test_leaving_ends_every_child(self):
        with Household(Path(self.folder.name)) as household:
            children = [household.start(f"sleeper-{i}", ["sleep", "60"]) for i in range(3)]
            household.check()
        self.assertTrue(all(child.exit_code is not None for child in children))

    def test_a_dead_child_is_reported_with_its_last_words(self):
        with Household(Path(self.folder.name)) as household:
            other = household.start("other", ["sleep", "60"])
            child = household.start("teller", ["sh", "-c", "echo it broke >&2; exit 3"])
            child.wait(10.0)
            with self.assertRaisesRegex(Failure, "teller ended with 3") as caught:
                household.check()
            self.assertIn("it broke", caught.exception.detail)
        self.assertIsNotNone(other.exit_code)

    def test_a_child_that_ignores_sigterm_is_killed(self):
        with Household(Path(self.folder.name)) as household:
            child = household.start("deaf", ["sh", "-c", "trap '' TERM; echo ready; while :; do sleep 0.1; done"])
            self.assertEqual(child.next_line(10.0), "ready")
            began = time.monotonic()
            self.assertEqual(child.end(patience_s=0.3), -9)
            self.assertLess(time.monotonic() - began, 10.0)

    def test_children_do_not_outlive_their_starter(self):
        code = ("import sys, time; from pathlib import Path; from processes import Household\n"
                f"child = Household(Path({self.folder.name!r})).start('sleeper', ['sleep', '60'])\n"
                "print(child._process.pid, flush=True); time.sleep(60)")
        with Household(Path(self.folder.name)) as household:
            environment = {**os.environ, "PYTHONPATH": str(ROOT / "deploy/session")}
            starter = household.start("starter", [sys.executable, "-B", "-c", code], environment)
            grandchild = int(starter.next_line(20.0))
            self.wait_until(lambda: Path(f"/proc/{grandchild}/comm").read_text() == "sleep\n")
            starter._process.kill()
            starter.wait(10.0)
        self.wait_until(lambda: self.has_ended(grandchild))

    @staticmethod
    def has_ended(pid):
        try:
            return " Z " in Path(f"/proc/{pid}/stat").read_text()  # a zombie has ended, whatever its parent is now
        except OSError:
            return True

    def wait_until(self, condition):
        deadline = time.monotonic() + 10.0
        while not condition():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)


class Commands(unittest.TestCase):
    """Tests what the commands in deploy/ answer to wrong arguments: one sentence, at once, from any folder, without
    an environment."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="with space ")
        self.addCleanup(self.folder.cleanup)

    def command(self, *arguments):
        return subprocess.run([ROOT / "deploy" / arguments[0], *arguments[1:]], cwd=self.folder.name, env={},
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=30, check=False)

    def refused(self, *arguments):
        result = self.command(*arguments)
        self.assertNotEqual(result.returncode, 0)
        self.assertEqual(result.stdout, "")
        self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)
        self.assertIn(f"deploy/{arguments[0]}: ", result.stderr)
        return result.stderr

    def test_demo(self):
        self.assertIn("no-such-ct", self.refused("demo", "--case", "no-such-ct"))
        self.assertIn("--out", self.refused("demo", "--out"))
        self.assertIn("--fast", self.refused("demo", "--fast"))
        Path(self.folder.name, "mine").write_text("keep me")
        self.assertIn("not empty", self.refused("demo", "--out", self.folder.name))
        self.assertEqual(Path(self.folder.name, "mine").read_text(), "keep me")

    def test_build_and_install(self):
        self.assertIn("no preset 'fast'", self.refused("build", "fast"))
        self.assertIn("everything", self.refused("install", "everything"))

    def test_figures(self):
        self.assertIn("no_such_figure", self.refused("figures", "no_such_figure"))
        listed = self.command("figures", "--list")
        self.assertEqual(listed.returncode, 0, listed.stderr)
        self.assertIn("haptic_work_p99", listed.stdout)

    def test_help(self):
        for name in ("demo", "test", "figures", "build", "install"):
            result = self.command(name, "--help")
            self.assertEqual((result.returncode, result.stderr), (0, ""), name)
            self.assertTrue(result.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
