"""Checks that deploy/docs/plan.schema.json and `osteon-haptic plan check` agree on which plans are valid.

plan_schema_test.py OSTEON_HAPTIC: the values are changed at random, with a fixed seed."""
import copy
import json
import os
import random
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import jsonschema

SOURCE = Path(os.environ["OSTEON_SOURCE_DIR"])
SCHEMA = json.loads((SOURCE / "deploy/docs/plan.schema.json").read_text(encoding="utf-8"))
HAPTIC = os.environ["OSTEON_HAPTIC"]
PLANS = 400
POINT = {"point_mm": [1.0, 2.0, 3.0], "axis": [0.0, 0.0, -1.0]}
VALID = [
    {"action": "wait", "seconds": 0.5},
    {"action": "place", "tool": "guide-1", "entry": POINT},
    {"action": "place", "entry": {"toward": [0.0, 0.0, -1.0]}, "seconds": 1.0},
    {"action": "screw", "tool": "screw-1", "spindle_rpm": 200.0, "entry": POINT, "tremor_mm": 0.1},
    {"action": "burr", "tool": "burr-round-5", "window_mm": [4.0, 5.0], "depth_mm": 1.0, "sweep_mm_per_s": 10.0,
     "entry": POINT},
    {"action": "drill", "tool": "drill-3.2", "hand": "expert", "push_n": 29.0, "entry": POINT,
     "irrigation": True, "suction": False},
    {"action": "drill", "entry": {"point_mm": [1.0, 2.0, 3.0], "target_mm": [1.0, 2.0, -20.0]}},
    {"action": "drill", "hand": "rig", "feed_mm_per_s": 1.0, "beyond_mm": 5.0, "entry": {"beside_last_mm": [6.0, 0.0]}},
    {"action": "drill", "guide": True, "wear": 2.0, "law": "chi"},
    {"action": "drill", "tool": "pin-1", "to_mm": 20.0, "leave": True, "entry": POINT},
]
# Replacement values: numbers beyond every limit and at some limits, values of other types, and nothing.
OTHERS = [-1.0, 0.0, 1.0, 1e9, "expert", "x", True, False, None, [], [1.0, 2.0], [1.0, 2.0, 3.0], {}]
FIELDS = sorted({field for step in VALID for field in step} | {"leave", "guide", "unknown"})


def changed(step, chance):
    step = copy.deepcopy(step)
    field = chance.choice(FIELDS)
    if chance.random() < 0.3:
        step.pop(field, None)
    else:
        step[field] = copy.deepcopy(chance.choice(OTHERS))
    return step


class PlanSchema(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.by_schema = jsonschema.Draft202012Validator(SCHEMA)

    def by_program(self, plans):
        """Exit code of one `plan check` of all plans, and for each plan its fault, "" if it is valid."""
        files = [f"plan-{number:03}.json" for number in range(len(plans))]
        for file, plan in zip(files, plans):
            (self.folder / file).write_text(json.dumps(plan), encoding="utf-8")
        done = subprocess.run([HAPTIC, "plan", "check", *files], capture_output=True, text=True, check=False,
                              timeout=300, cwd=self.folder)
        faults = []
        for file in files:
            valid = done.stdout.count(f"{file}: valid, ")
            refused = [line for line in done.stderr.splitlines() if file in line]
            self.assertEqual(valid + len(refused), 1, f"{file}: {done.stdout}{done.stderr}")
            faults.append(refused[0] if refused else "")
        return done.returncode, faults

    def test_valid_plans_are_valid_for_both(self):
        plan = {"steps": VALID}
        self.by_schema.validate(plan)
        self.assertEqual(self.by_program([plan]), (0, [""]))

    def test_a_fault_hides_none_of_the_next_plan(self):
        code, faults = self.by_program([{"steps": 1}, {"steps": VALID}, {"steps": 2}])
        self.assertEqual((code, [fault != "" for fault in faults]), (1, [True, False, True]))

    def test_both_refuse_an_entry_with_too_little_or_too_much(self):
        point, axis, target = [1.0, 2.0, 3.0], [0.0, 0.0, -1.0], [1.0, 2.0, -20.0]
        plans = [{"steps": [{"action": "drill", "entry": entry}]}
                 for entry in ({"point_mm": point, "axis": axis, "target_mm": target}, {"point_mm": point},
                               {"target_mm": target}, {"axis": axis}, {"axis": axis, "target_mm": target})]
        _, faults = self.by_program(plans)
        for plan, fault in zip(plans, faults):
            self.assertFalse(self.by_schema.is_valid(plan))
            self.assertIn('"point_mm" together with either "axis" or "target_mm"', fault)

    def test_both_judge_changed_plans_alike(self):
        chance = random.Random(1)
        plans = [{"steps": [changed(chance.choice(VALID), chance)]} for _ in range(PLANS)]
        _, faults = self.by_program(plans)
        for plan, fault in zip(plans, faults):
            # Only the program checks whether a law suits its tool.
            if '"law"' not in fault:
                self.assertEqual(self.by_schema.is_valid(plan), fault == "", f"{json.dumps(plan)}: {fault}")
        valid = faults.count("")
        self.assertGreater(valid, PLANS // 20)
        self.assertLess(valid, PLANS // 2)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
