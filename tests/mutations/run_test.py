"""Tests the runner of the mutations with a small tree and a build that only reads it."""
import contextlib
import io
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parent))

import run  # noqa: E402

TWICE = "int twice(int x) { return 2 * x; }\n"


def mutation(**changes):
    given = {"file": "twice.cpp", "text": "2 * x", "replacement": "3 * x", "breaks": "it is thrice", "target": "unit",
             "filter": "*"}
    return run.Mutation(**{**given, **changes})


class FakeCopy:
    """Its test asks for "2 * x" or whatever `wanted` says, and nothing builds with "bad" in it."""

    wanted, stop_at, tests = "2 * x", None, True

    def __init__(self, _root, tree, *_):
        self.tree, self.builds = tree, 0

    def update(self):
        (self.tree / "twice.cpp").write_text(TWICE)

    def text(self):
        return (self.tree / "twice.cpp").read_text()

    def build(self, _target):
        self.builds += 1
        if self.builds == self.stop_at:
            raise KeyboardInterrupt
        return "bad" not in self.text()

    def has_tests(self, *_):
        return self.tests

    def failure(self, *_):
        return "" if self.wanted in self.text() else "Twice.IsTwice"


class Runner(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        (self.root / "twice.cpp").write_text(TWICE)

    def main(self, mutations, *given, **attributes):
        kind = type("Kind", (FakeCopy,), attributes)
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            code = run.main(mutations, ["--scratch", str(self.root / "scratch"), *given], self.root, kind)
        return code, said.getvalue()

    def expect_restored(self):
        self.assertEqual((self.root / "scratch/tree/twice.cpp").read_text(), TWICE)
        self.assertEqual((self.root / "twice.cpp").read_text(), TWICE)

    def test_what_a_test_notices_is_caught(self):
        code, said = self.main([mutation()])
        self.assertEqual(code, 0)
        self.assertIn("1 caught", said)
        self.assertEqual(said.count("Twice.IsTwice"), 2)  # at once, and in the table
        self.expect_restored()

    def test_one_that_survives_fails_the_run(self):
        code, said = self.main([mutation(), mutation(text="int twice", replacement="long twice")])
        self.assertEqual(code, 1)
        self.assertIn("1 caught, 1 survived", said)
        self.expect_restored()

    def test_one_that_is_explained_may_survive(self):
        code, said = self.main([mutation(text="int twice", replacement="long twice", equivalent="it is as wide")])
        self.assertEqual((code, "1 equivalent" in said), (0, True))

    def test_one_that_does_not_compile_proves_nothing(self):
        code, said = self.main([mutation(replacement="bad")])
        self.assertEqual(code, 1)
        self.assertIn("1 did not compile", said)
        self.expect_restored()

    def test_a_test_that_fails_anyway_or_is_not_there_proves_nothing(self):
        for attributes in ({"wanted": "5 * x"}, {"tests": False}):
            code, said = self.main([mutation()], **attributes)
            self.assertEqual(code, 1)
            self.assertIn("1 no valid test", said)

    def test_stopped_it_restores_and_shows_what_it_has(self):
        # Of the two builds of a mutation, the second is on the changed file. The third is the next one's.
        for stop_at, caught in ((1, 0), (2, 0), (3, 1)):
            code, said = self.main([mutation(), mutation(replacement="4 * x")], stop_at=stop_at)
            self.assertEqual(code, 130)
            self.assertIn("stopped; the sources are as before", said)
            self.assertEqual(said.count("not run"), 2 - caught)
            self.expect_restored()

    def test_runs_only_what_is_asked_for(self):
        code, said = self.main([mutation(), mutation(replacement="4 * x")], "--only", "2")
        self.assertEqual(code, 0)
        self.assertIn("[1/1] 2:", said)
        self.assertEqual(self.main([mutation()], "--only", "2")[0], 2)

    def test_lists_and_checks_without_a_build(self):
        for option in ("--list", "--check"):
            code, _ = self.main([mutation()], option, stop_at=1)
            self.assertEqual(code, 0)
        self.assertFalse((self.root / "scratch").exists())

    def test_finds_what_can_no_longer_be_made(self):
        wrong = {
            "has the text 0 times": mutation(text="4 * x"),
            "has the text 2 times": mutation(text="x"),
            "there is no": mutation(file="thrice.cpp"),
            "changes nothing": mutation(replacement="2 * x"),
            "a field is empty": mutation(filter=""),
        }
        for why, one in wrong.items():
            code, said = self.main([one], "--check")
            self.assertEqual(code, 1, why)
            self.assertIn("1: ", said)
            self.assertIn(why, said)
        code, said = self.main([mutation(), mutation()], "--check")
        self.assertEqual((code, "twice" in said), (1, True))


class Copies(unittest.TestCase):
    def test_a_command_that_takes_too_long_is_ended(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = run.Copy(Path(folder), Path(folder) / "tree", 1, 1.0)
            self.assertIsNone(copy.run(["sleep", "1000"], folder, 0.2))
            self.assertEqual(copy.run(["false"], folder, 60.0), 1)

    def test_sigterm_ends_what_it_runs(self):
        script = ("import run, sys; from pathlib import Path; run.stop_on_sigterm(); folder = Path(sys.argv[1]); "
                  "copy = run.Copy(folder, folder / 'tree', 1, 1.0); "
                  "copy.run(['sh', '-c', 'echo $$ >begun; exec sleep 600'], folder)")
        with tempfile.TemporaryDirectory() as folder:
            begun = Path(folder) / "begun"
            running = subprocess.Popen([sys.executable, "-Bc", script, folder], cwd=Path(run.__file__).parent,
                                       stderr=subprocess.DEVNULL)
            self.addCleanup(running.kill)
            while not (begun.exists() and begun.read_text().strip()):
                self.assertIsNone(running.poll(), "it ended before the command began")
                time.sleep(0.02)
            running.send_signal(signal.SIGTERM)
            running.wait(60)
            self.assertFalse(Path("/proc", begun.read_text().strip()).exists())

    def test_a_signal_while_a_command_begins_ends_it_too(self):
        def popen_with_signal(*args, **keywords):
            begun.append(popen(*args, **keywords))
            signal.raise_signal(signal.SIGINT)
            return begun[0]

        # A shell that starts the tests in the background has SIGINT ignored.
        self.addCleanup(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler))
        begun, popen = [], subprocess.Popen
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(subprocess, "Popen", popen_with_signal):
            with self.assertRaises(KeyboardInterrupt):
                run.Copy(Path(folder), Path(folder) / "tree", 1, 1.0).run(["sleep", "600"], folder)
        self.addCleanup(begun[0].kill)
        self.assertIsNotNone(begun[0].returncode)

    def test_names_the_test_that_fails_first(self):
        ended = {
            "echo '[  FAILED  ] Room/Cut.Is/1, where x'; echo '[  FAILED  ] Later.One'; exit 1": "Room/Cut.Is/1",
            "exit 3": "exit code 3",
            "sleep 1000": "no end within 1 s",
            "echo '[  PASSED  ] 1 test.'": "",
        }
        for script, expected in ended.items():
            with tempfile.TemporaryDirectory() as folder:
                copy = run.Copy(Path(folder), Path(folder) / "tree", 1, 1.0)
                program = copy.tree / "build/dev/bin/unit"
                program.parent.mkdir(parents=True)
                program.write_text(f"#!/bin/sh\n{script}\n")
                program.chmod(0o755)
                copy.log.write_text("[  FAILED  ] Of.AnEarlierRun\n")
                self.assertEqual(copy.failure("unit", "*"), expected)

    def test_a_copy_keeps_the_times_of_what_did_not_change(self):
        with tempfile.TemporaryDirectory() as folder:
            root, tree = Path(folder) / "root", Path(folder) / "tree"
            root.mkdir()
            tree.mkdir()
            run.subprocess.run(["git", "init", "-q"], cwd=root, check=True)
            (root / "a").write_text("1")
            (root / "b").write_text("1")
            copy = run.Copy(root, tree, 1, 1.0)
            copy.update()
            before = (tree / "a").stat().st_mtime_ns
            (root / "b").unlink()
            (root / "c").write_text("2")
            copy.update()
            self.assertEqual((tree / "a").stat().st_mtime_ns, before)
            self.assertEqual(sorted(p.name for p in tree.iterdir()), ["a", "c"])


if __name__ == "__main__":
    unittest.main()
