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
    return -np.array(entry["axis"]) if is_placed(entry) else np.array(entry["toward"], dtype=float)


def from_two_sides(first, second):
    """Entries of two surgeons, and of an instructor beside the first of them."""
    return [toward(first), toward(second), toward(np.array(first) + [0.0, 0.3, 0.0])]


def is_placed(entry):
    """Whether the entry is a point with an axis, as on a phantom, and not a direction."""
    return "point_mm" in entry


def on_phantom(case, bone):
    """Entries of two surgeons and of an instructor on a phantom bone.

    `case` has landmarks and axes in mm, LPS. deploy/docs/guide.md says where the surgeons work.
    """
    marks = {mark["name"]: np.array(mark["point_mm"]) for mark in case["landmarks"]}
    if bone in ("femur", "tibia"):
        axis = next((axis for axis in case["axes"] if axis["name"] == "anatomical axis"), None)
        return on_shaft(marks, axis, bone)
    return {"patella": on_patella, "pelvis": on_pelvis, "hip": on_hip, "knee": on_knee}[bone](marks)


def across(point, direction, up=(0.0, 0.0, 1.0)):
    """The entry of a surgeon who stands in this direction from a point, across `up`, a unit vector."""
    direction, up = np.array(direction, dtype=float), np.array(up)
    direction = direction - (direction @ up) * up
    return {"point_mm": point.tolist(), "axis": (-direction / np.linalg.norm(direction)).tolist()}


def above(point, height_mm):
    return point + np.array([0.0, 0.0, height_mm])


def on_shaft(marks, axis, bone):
    """The first surgeon works laterally on a femur, at the apex of its bow, and medially on a tibia, at a quarter of
    the way from the knee to the ankle. The second one works in front, further down, the instructor above the first."""
    if bone == "femur":
        centre, up = np.array(axis["point_mm"]), np.array(axis["direction"])
        side = marks["lateral epicondyle"] - marks["medial epicondyle"]
    else:
        up = marks["knee centre"] - marks["ankle centre"]
        centre = marks["knee centre"] - 0.25 * up
        side = marks["medial malleolus"] - marks["lateral malleolus"]
    up = up / np.linalg.norm(up)
    return [across(centre, side, up), across(centre - APART_MM * up, FRONT, up),
            across(centre + APART_MM * up, side, up)]


def on_patella(marks):
    """In front, towards the base. There is no room for two."""
    apex, base = marks["patellar apex"], marks["patellar base"]
    return [across(0.35 * apex + 0.65 * base, FRONT)]


def on_pelvis(marks):
    """Outside on both wings of the ilium, midway between the iliac spines. The instructor works further in front."""
    def wing(side, forward):
        front, back = (marks[f"{side} {place} superior iliac spine"] for place in ("anterior", "posterior"))
        return forward * front + (1.0 - forward) * back

    outwards = wing("left", 0.5) - wing("right", 0.5)
    return [across(wing("left", 0.5), outwards), across(wing("right", 0.5), -outwards),
            across(wing("left", 0.7), outwards)]


def on_hip(marks):
    """Laterally below the greater trochanter, outside on the wing of the ilium, and laterally on the shaft."""
    trochanter = marks["greater trochanter"]
    wing = 0.5 * (marks["anterior superior iliac spine"] + marks["posterior superior iliac spine"])
    lateral = trochanter - marks["head centre"]
    return [across(above(trochanter, -APART_MM), lateral), across(wing, lateral),
            across(above(trochanter, -2.0 * APART_MM), lateral)]


def on_knee(marks):
    """Laterally on the femur above its epicondyle, medially on the tibia, and laterally on the femur further up."""
    epicondyle, tibia = marks["lateral epicondyle"], marks["tibia, knee centre"]
    lateral = epicondyle - marks["medial epicondyle"]
    # The shaft lies in front of the epicondyles, a quarter of the way to the patella.
    femur = epicondyle + [0.0, 0.25 * (marks["patellar ridge"] - epicondyle)[1], 0.0]
    return [across(above(femur, APART_MM), lateral), across(above(tibia, -1.5 * APART_MM), -lateral),
            across(above(femur, 2.0 * APART_MM), lateral)]


def burr_window(entry, size_mm):
    """The step that burrs a window."""
    return {"action": "burr", "tool": "burr-round-5", "spindle_rpm": 20000, "hand": "expert", "entry": entry,
            "window_mm": list(size_mm), "depth_mm": 2.0, "sweep_mm_per_s": 15}


def drill_and_window(entry):
    """A 3.2 mm hole, and a small window burred beside it, or below it on a phantom."""
    beside, size_mm = ([0, 14], [7, 10]) if is_placed(entry) else ([14, 0], [10, 7])
    return {"steps": [
        {"action": "drill", "tool": "drill-3.2", "spindle_rpm": 1000, "hand": "expert", "entry": entry},
        {"action": "wait", "seconds": 0.5},
        burr_window({"beside_last_mm": beside}, size_mm),
        {"action": "wait", "seconds": 0.5},
    ]}


def window(entry, size_mm, then_s):
    """A window, longest along the shaft of a long bone. Afterwards the hand stays for a time."""
    size_mm = sorted(size_mm) if is_placed(entry) else size_mm
    return {"steps": [burr_window(entry, size_mm), {"action": "wait", "seconds": then_s}]}


def drill(hand, toward=(0, 0, 1), **more):
    """One hole through all bone along the way, by the rig or by a hand."""
    step = {"action": "drill", "tool": "drill-3.2", "spindle_rpm": 1000, "hand": hand,
            "entry": {"toward": list(toward)}}
    return {"steps": [{**step, **more}, {"action": "wait", "seconds": 0.5}]}
