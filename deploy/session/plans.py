"""Plans of the simulated surgeon."""

# Towards the left parietal bone of a skull in the patient's frame: x left, y back, z up.
LEFT_PARIETAL = [0.75, 0.25, 0.65]
RIGHT_PARIETAL = [-0.75, 0.25, 0.65]
# Bones of the leg lie along z, and their shafts bow forwards. A ray along y through their middle meets the shaft.
FRONT, BACK = [0, -1, 0], [0, 1, 0]
# For an unknown bone: from above, then from each side, until one direction meets bone.
ANY_SIDE = [[0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1]]


def drill_and_window(toward, on_shaft=False):
    """A 3.2 mm hole, and a small window burred beside it, or above it on the shaft of a long bone."""
    beside, window = ([0, 14], [7, 10]) if on_shaft else ([14, 0], [10, 7])
    return {"steps": [
        {"action": "drill", "tool": "drill-3.2", "spindle_rpm": 1000, "hand": "expert", "entry": {"toward": toward}},
        {"action": "wait", "seconds": 0.5},
        {"action": "burr", "tool": "burr-round-5", "spindle_rpm": 20000, "hand": "expert",
         "entry": {"beside_last_mm": beside}, "window_mm": window, "depth_mm": 2.0, "sweep_mm_per_s": 15},
        {"action": "wait", "seconds": 0.5},
    ]}


def drill(hand, toward=(0, 0, 1), **more):
    """One hole through all bone along the way, by the rig or by a hand."""
    step = {"action": "drill", "tool": "drill-3.2", "spindle_rpm": 1000, "hand": hand,
            "entry": {"toward": list(toward)}}
    return {"steps": [{**step, **more}, {"action": "wait", "seconds": 0.5}]}
