"""Tests how deploy/demo --together judges what hands felt: growth of force that neither the hand nor the slew limit
explains."""
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "deploy" / "session"))

import together  # noqa: E402

STIFFNESS = 10.0  # N/mm


def judged(force_x, handle_x=None, apart_ms=None):
    force = np.zeros((len(force_x), 3))
    force[:, 0] = force_x
    handle = np.zeros((len(force_x), 3))
    handle[:, 1] = 0.0 if handle_x is None else handle_x
    times = np.cumsum(np.ones(len(force_x)) if apart_ms is None else apart_ms) * 1e6
    return together.force_steps(force, handle, times, STIFFNESS)["steps_beyond_slew"]


class ForceSteps(unittest.TestCase):
    def test_growth_up_to_the_limit_is_gentle(self):
        self.assertEqual(judged(np.arange(0.0, 20.0, 0.5)), 0)

    def test_a_step_beyond_it_is_found(self):
        self.assertEqual(judged([0.0, 0.0, 0.6, 0.6]), 1)
        self.assertEqual(judged([5.0, 5.0, 6.0, 6.0, 7.5]), 2)

    def test_lessening_comes_at_once_and_turning_about_does_not(self):
        self.assertEqual(judged([8.0, 8.0, 0.0, 0.0]), 0)
        self.assertEqual(judged([8.0, 8.0, -1.0, -1.0]), 1)

    def test_a_hand_that_moves_may_cause_it(self):
        # The spring and its damping: 2 k for each mm.
        self.assertEqual(judged([0.0, 2.4, 2.4], handle_x=[0.0, 0.1, 0.1]), 0)
        self.assertEqual(judged([0.0, 2.6, 2.6], handle_x=[0.0, 0.1, 0.1]), 1)

    def test_a_late_tick_stands_for_the_periods_that_passed(self):
        self.assertEqual(judged([0.0, 0.0, 1.5, 1.5], apart_ms=[1.0, 1.0, 3.0, 1.0]), 0)
        self.assertEqual(judged([0.0, 0.0, 2.5, 2.5], apart_ms=[1.0, 1.0, 3.0, 1.0]), 1)

    def test_how_far_a_hand_was_led_counts_from_where_that_began(self):
        names = ["uncovered", "hand guided"]
        way = np.zeros((7, 3))
        way[:, 0] = [0.0, 5.0, 6.0, 8.5, 20.0, 30.0, 31.0]
        self.assertEqual(together.led_mm(np.array([0, 2, 3, 2, 1, 2, 2]), names, way), 3.5)
        self.assertEqual(together.led_mm(np.zeros(7, dtype=int), names, way), 0.0)

    def test_whoever_was_not_recorded_is_not_called_gentle(self):
        gentle = {"rows": 5000, "steps_beyond_slew": 0}
        self.assertTrue(together.is_gentle({"anna": gentle, "ben": gentle}))
        self.assertFalse(together.is_gentle({"anna": gentle, "ben": {"rows": 3, "steps_beyond_slew": 0}}))
        self.assertFalse(together.is_gentle({"anna": gentle, "ben": {"rows": 5000, "steps_beyond_slew": 1}}))


if __name__ == "__main__":
    unittest.main()
