"""Plans of the simulated surgeon, and the entries where they begin."""
import numpy as np

# Towards the left parietal bone of a skull in the patient's frame: x left, y back, z up.
LEFT_PARIETAL = [0.75, 0.25, 0.65]
RIGHT_PARIETAL = [-0.75, 0.25, 0.65]
FRONT = [0, -1, 0]
# For an unknown bone: from above, then from each side, until one direction meets bone.
ANY_SIDE = [[0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1]]
# Between the entries of several surgeons along a shaft. Their windows are 18 mm long.
APART_MM = 30.0


def toward(direction):
    """The entry where a ray from outside, against this direction, meets the bone."""
    return {"toward": list(direction)}


def outward(entry):
    """The direction from an entry to the surgeon. It has any length."""
    return -np.array(entry["axis"]) if is_on_shaft(entry) else np.array(entry["toward"], dtype=float)


def from_two_sides(first, second):
    """Entries of two surgeons, and of an instructor beside the first of them."""
    return [toward(first), toward(second), toward(np.array(first) + [0.0, 0.3, 0.0])]


def is_on_shaft(entry):
    """Whether the entry is one of on_shaft."""
    return "point_mm" in entry


def on_shaft(case, bone):
    """Entries of two surgeons and of an instructor on the shaft of a femur or a tibia, across the shaft.

    `case` has landmarks and axes in mm, LPS. The first surgeon works laterally on a femur, at the apex of its bow, and
    medially on a tibia, at a quarter of the way from the knee to the ankle. The second surgeon works in front, further
    down. The instructor works above the first surgeon.
    """
    marks = {mark["name"]: np.array(mark["point_mm"]) for mark in case["landmarks"]}
    if bone == "femur":
        shaft = next(axis for axis in case["axes"] if axis["name"] == "anatomical axis")
        centre, up = np.array(shaft["point_mm"]), np.array(shaft["direction"])
        side = marks["lateral epicondyle"] - marks["medial epicondyle"]
    else:
        up = marks["knee centre"] - marks["ankle centre"]
        centre = marks["knee centre"] - 0.25 * up
        side = marks["medial malleolus"] - marks["lateral malleolus"]
    up = up / np.linalg.norm(up)

    def entry(direction, along_mm):
        across = direction - (direction @ up) * up
        return {"point_mm": (centre + along_mm * up).tolist(), "axis": (-across / np.linalg.norm(across)).tolist()}

    return [entry(side, 0.0), entry(np.array(FRONT), -APART_MM), entry(side, APART_MM)]


def burr_window(entry, size_mm):
    """The step that burrs a window."""
    return {"action": "burr", "tool": "burr-round-5", "spindle_rpm": 20000, "hand": "expert", "entry": entry,
            "window_mm": list(size_mm), "depth_mm": 2.0, "sweep_mm_per_s": 15}


def drill_and_window(entry):
    """A 3.2 mm hole, and a small window burred beside it, or below it on the shaft of a long bone."""
    beside, size_mm = ([0, 14], [7, 10]) if is_on_shaft(entry) else ([14, 0], [10, 7])
    return {"steps": [
        {"action": "drill", "tool": "drill-3.2", "spindle_rpm": 1000, "hand": "expert", "entry": entry},
        {"action": "wait", "seconds": 0.5},
        burr_window({"beside_last_mm": beside}, size_mm),
        {"action": "wait", "seconds": 0.5},
    ]}


def window(entry, size_mm, then_s):
    """A window, longest along the shaft of a long bone. Afterwards the hand stays for a time."""
    size_mm = sorted(size_mm) if is_on_shaft(entry) else size_mm
    return {"steps": [burr_window(entry, size_mm), {"action": "wait", "seconds": then_s}]}


def drill(hand, toward=(0, 0, 1), **more):
    """One hole through all bone along the way, by the rig or by a hand."""
    step = {"action": "drill", "tool": "drill-3.2", "spindle_rpm": 1000, "hand": hand,
            "entry": {"toward": list(toward)}}
    return {"steps": [{**step, **more}, {"action": "wait", "seconds": 0.5}]}
