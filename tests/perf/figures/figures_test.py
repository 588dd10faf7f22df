"""Tests the rules of the figures: the printed form, the verdicts, and that the registry is complete."""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import against  # noqa: E402
import figures  # noqa: E402
import groups  # noqa: E402
import hours  # noqa: E402
import registry  # noqa: E402
import results  # noqa: E402
from registry import Figure  # noqa: E402

FORM = re.compile(r"^\S+ \S+ \S+ \(baseline \S+, ratio \S+(, min \S+, max \S+)?(, threads \d+)?\) "
                  r"target \S+ (ok|short|info)$")
TIMES = {"ns", "us", "ms", "s"}


class Registry(unittest.TestCase):
    def test_names_are_unique_and_groups_exist(self):
        names = [f.name for f in registry.FIGURES]
        self.assertEqual(len(names), len(set(names)))
        self.assertLessEqual({f.group for f in registry.FIGURES}, set(groups.GROUPS))

    def test_no_absolute_time_is_decided(self):
        self.assertEqual([f.name for f in registry.FIGURES if f.unit in TIMES and f.target], [])

    def test_what_takes_minutes_runs_when_asked_for(self):
        slow = [f.name for f in registry.FIGURES if f.full]
        self.assertTrue(slow)
        self.assertFalse(set(slow) & {f.name for f in registry.by_name([])})
        self.assertLessEqual(set(slow), {f.name for f in registry.by_name([], full=True)})
        self.assertEqual([f.name for f in registry.by_name(slow[:1])], slow[:1])

    def test_groups_are_slow_or_quick_as_a_whole(self):
        for group in groups.GROUPS:
            self.assertLessEqual(len({f.full for f in registry.FIGURES if f.group == group}), 1, group)

    def test_an_unknown_name_is_an_error(self):
        with self.assertRaises(ValueError):
            registry.by_name(["no_such_figure"])


class Lines(unittest.TestCase):
    def test_every_kind_has_the_promised_form(self):
        figure = Figure("f", "ratio", "x", "bench", ("<=", 2.0))
        for value, baseline in ((1.5, 3.0), (1.5, None), (0, None), (None, None), (1.0, 0.0)):
            self.assertRegex(figures.line(figure, value, baseline), FORM)
            self.assertRegex(figures.line(figure, *registry.Measured(value, baseline, 1.0, 2.0, 2)), FORM)

    def test_verdicts(self):
        self.assertEqual(Figure("f", "ratio", "x", "bench", ("<=", 2.0)).verdict(2.0), "ok")
        self.assertEqual(Figure("f", "ratio", "x", "bench", ("<=", 2.0)).verdict(2.1), "short")
        self.assertEqual(Figure("f", "ratio", "x", "bench", (">=", 2.0)).verdict(1.9), "short")
        self.assertEqual(Figure("f", "count", "x", "bench", ("==", 0)).verdict(1), "short")
        self.assertEqual(Figure("f", "us", "x", "bench").verdict(1e9), "info")
        self.assertEqual(Figure("f", "count", "x", "bench", ("==", 0)).verdict(None), "short")


class FakeRunner:
    """Gives values that were written down, and notes the order in which the sides were measured."""

    def __init__(self, values, known=("fast", "slow")):
        self.values, self.known, self.order = {side: iter(rounds) for side, rounds in values.items()}, known, []

    def say(self, _text):
        pass

    def names(self, _tree):
        return self.known

    def measure(self, tree, names):
        self.order.append(tree)
        value = next(self.values[tree])
        return {name: (value, "us") for name in names if name != "lost"}


class Against(unittest.TestCase):
    def test_both_sides_take_turns_and_the_medians_count(self):
        runner = FakeRunner({"here": [10.0, 30.0, 12.0], "there": [20.0, 20.0, 48.0]})
        (found,), missing = against.compare(runner, ["fast"], "here", "there", 3)
        self.assertEqual(runner.order, ["here", "there", "there", "here", "here", "there"])
        self.assertEqual(missing, [])
        self.assertEqual(found.line("0123abc"), "fast us: here 12 (min 10, max 30); 0123abc 20 (min 20, max 48); "
                                                "ratio 0.5 (min 0.25, max 1.5)")

    def test_a_figure_of_one_side_only_is_left_out_and_named(self):
        runner = FakeRunner({"here": [1.0], "there": [2.0]}, known=("fast", "lost"))
        found, missing = against.compare(runner, ["fast", "new", "lost"], "here", "there", 1)
        self.assertEqual(([c.name for c in found], missing), (["fast"], ["new"]))
        with self.assertRaises(against.Trouble):
            against.compare(runner, ["new"], "here", "there", 1)

    def test_the_other_commit_gets_a_worktree_that_is_used_again(self):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            git = ("git", "-C", folder, "-c", "user.name=a", "-c", "user.email=a@b", "-c", "init.defaultBranch=main")
            (root / "deploy").mkdir()
            commits = []
            subprocess.run([*git, "init", "-q"], check=True)
            for text in ("one", "two"):
                (root / "deploy/figures").write_text(text, encoding="utf-8")
                subprocess.run([*git, "add", "-A"], check=True)
                subprocess.run([*git, "commit", "-q", "-m", text], check=True)
                commits.append(against.resolve("HEAD", root))
            tree = root / "build" / "against"
            for commit, text in zip(commits, ("one", "two")):
                against.prepare(commit, root, tree)
                self.assertEqual((tree / "deploy/figures").read_text(encoding="utf-8"), text)
            with self.assertRaisesRegex(against.Trouble, "^there is no commit 'none-such' in this checkout$"):
                against.resolve("none-such", root)


    def test_a_short_figure_counts_and_a_failure_is_one_sentence(self):
        with tempfile.TemporaryDirectory() as folder:
            program = Path(folder) / "deploy/figures"
            program.parent.mkdir()
            runner = against.Runner(soak=False, say=print)

            def write(text):
                program.write_text("#!/bin/sh\n" + text, encoding="utf-8")
                program.chmod(0o755)
            write("""echo '{"figures": {"fast": {"value": 2.5, "unit": "us"}}}'; exit 1""")
            self.assertEqual(runner.measure(Path(folder), ["fast"]), {"fast": (2.5, "us")})
            write("echo one >&2; echo 'no compiler' >&2; exit 2")
            with self.assertRaisesRegex(against.Trouble,
                                        "^deploy/figures of the other commit ended with 2: no compiler$"):
                runner.measure(Path(folder), ["fast"])


class Results(unittest.TestCase):
    MACHINE = {"processor": "AMD EPYC", "cores": 2, "kernel": "6.1"}
    GROUPS = {"a": "cutting", "b": "cutting", "c": "rooms_per_core"}

    def outcome(self, commit, values):
        return {"commit": commit, "date": "2026-11-27", "size": "quick", "build": "perf", "machine": self.MACHINE,
                "compiler": "g++ 12", "simd_bits": 512, "load_before": 1.5,
                "figures": {name: figures.saved(Figure(name, "us", "x", "bench", ("<=", 2.0)), (value, None))
                            for name, value in values.items()}}

    def test_a_page_says_under_which_conditions(self):
        text = results.write([results.section(self.outcome("abc", {"a": 1.5, "c": 3}))], self.MACHINE, self.GROUPS)
        for part in ("AMD EPYC, 2 cores", "## abc, 2026-11-27", "g++ 12", "512 bits", "Load before: 1.5", "### cutting",
                     "### rooms per core", "| a | 1.5 | us | - | - | - | - | <=2 | ok |", "| c | 3 | us |"):
            self.assertIn(part, text)
        self.assertLessEqual(max(len(line) for line in text.splitlines()), 120)

    def test_what_is_measured_again_moves_and_the_rest_stays(self):
        old = results.section(self.outcome("abc", {"a": 1.0, "b": 2.0, "gone": 4.0}))
        text = results.write([old], self.MACHINE, {**self.GROUPS, "gone": "rig"})
        again = results.merged(results.read(text), results.section(self.outcome("def", {"a": 9.0})), self.GROUPS)
        self.assertEqual([(s.commit, list(s.rows)) for s in again], [("def", ["a"]), ("abc", ["b"])])
        self.assertEqual(again[1].conditions, old.conditions)
        self.assertIn("| 9 |", again[0].rows["a"])

    def test_the_file_is_named_by_the_processor(self):
        self.assertEqual(results.results_file(self.MACHINE).name, "amd-epyc-2-cores.md")


class Programs(unittest.TestCase):
    def test_a_program_that_is_missing_is_named_with_its_remedy(self):
        with tempfile.TemporaryDirectory() as folder:
            run = groups.Run(Path(folder), Path(folder), False, print)
            with self.assertRaisesRegex(groups.Failure, "osteon-none is not built; deploy/build perf"):
                run.output("osteon-none")


class SeveralSessions(unittest.TestCase):
    def test_the_worst_decides_and_the_median_informs(self):
        sessions = [{"rig_removed_volume_error": (error, None), "haptic_work_p50": (work, 1.0)}
                    for error, work in ((0.1, 9.0), (7.0, 10.0), (0.2, 30.0))]
        self.assertEqual(groups.over_sessions(sessions),
                         {"rig_removed_volume_error": (7.0, None), "haptic_work_p50": (10.0, 1.0)})

    def test_a_session_without_a_value_is_not_hidden(self):
        sessions = [{"rig_force_after_exit": (0.0, None)}, {"rig_force_after_exit": (None, None)}]
        self.assertIsNone(groups.over_sessions(sessions)["rig_force_after_exit"][0])


class Hours(unittest.TestCase):
    MINUTES = [float(minute) for minute in range(1, 61)]

    def test_a_leak_is_its_slope_and_the_warm_up_does_not_count(self):
        sizes = [100.0 + 20.0 * minute / 60.0 - (60.0 if minute < 10 else 0.0) for minute in self.MINUTES]
        found = hours.growth(self.MINUTES, sizes)
        self.assertAlmostEqual(found.mb_per_hour, 20.0, places=6)
        self.assertAlmostEqual(found.percent_per_hour(), 100.0 * 20.0 / (100.0 + 20.0 * 10 / 60.0), places=6)
        self.assertGreater(found.last_over_first, 1.1)

    def test_noise_is_no_growth(self):
        found = hours.growth(self.MINUTES, [200.0 + (3.0 if minute % 2 else -3.0) for minute in self.MINUTES])
        self.assertLess(abs(found.percent_per_hour()), 0.2)

    def test_a_process_that_was_away_gives_no_number(self):
        self.assertIsNone(hours.growth(self.MINUTES, [0.0 if minute == 30 else 100.0 for minute in self.MINUTES]))
        self.assertIsNone(hours.growth([1.0, 2.0], [100.0, 100.0]))
        self.assertIsNone(hours.growth([], []))


class Physics(unittest.TestCase):
    def test_chi_agrees_with_the_published_points(self):
        for density, force in ((0.3, 3.2), (0.5, 5.9), (1.0, 13.5), (1.8, 27.1), (2.0, 30.7)):
            self.assertAlmostEqual(groups.chi_force_n(1.0, density), force, delta=0.06)


if __name__ == "__main__":
    unittest.main(verbosity=2)
