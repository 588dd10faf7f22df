"""Tests the rules of the figures: the printed form, the verdicts, and that the registry is complete."""
import re
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import figures  # noqa: E402
import groups  # noqa: E402
import registry  # noqa: E402
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


class SeveralSessions(unittest.TestCase):
    def test_the_worst_decides_and_the_median_informs(self):
        sessions = [{"rig_removed_volume_error": (error, None), "haptic_work_p50": (work, 1.0)}
                    for error, work in ((0.1, 9.0), (7.0, 10.0), (0.2, 30.0))]
        self.assertEqual(groups.over_sessions(sessions),
                         {"rig_removed_volume_error": (7.0, None), "haptic_work_p50": (10.0, 1.0)})

    def test_a_session_without_a_value_is_not_hidden(self):
        sessions = [{"rig_force_after_exit": (0.0, None)}, {"rig_force_after_exit": (None, None)}]
        self.assertIsNone(groups.over_sessions(sessions)["rig_force_after_exit"][0])


class Physics(unittest.TestCase):
    def test_chi_agrees_with_the_published_points(self):
        for density, force in ((0.3, 3.2), (0.5, 5.9), (1.0, 13.5), (1.8, 27.1), (2.0, 30.7)):
            self.assertAlmostEqual(groups.chi_force_n(1.0, density), force, delta=0.06)


if __name__ == "__main__":
    unittest.main(verbosity=2)
