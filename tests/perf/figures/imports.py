"""Figures of the import of CT scans: the cost for real ones, and how a known bone changes by scan and import."""
import json
import os
import shutil
import subprocess
import sys
import time

import numpy as np

from registry import Measured

LAYERS_MM_DENSITY = "5:1.9,20:0.3,5:1.9"
SLAB_MM3 = 20.0 * 20.0 * 30.0
# The skull is Debian's example. The others lie beside the checkout, if they exist.
SCANS = {"skull": None, "tibia": "tibia-dicom", "body": "body-j2k-dicom"}


def find_scan(run, name):
    return run.example("Cranium.inv3") if SCANS[name] is None else run.shared_data(SCANS[name])


# A process's peak memory includes that of the process from which it was forked, so a small process starts the import.
MEASURE = """import os, sys
child = os.fork()
if child == 0:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1), os.dup2(nowhere, 2)
    os.execv(sys.argv[1], sys.argv[1:])
_, status, used = os.wait4(child, 0)
print(os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0)
"""


def cost_of(*command):
    """CPU seconds and peak memory, MB, of a program and its child processes. None if it fails."""
    measured = subprocess.run([sys.executable, "-S", "-c", MEASURE, *map(str, command)],
                              stdout=subprocess.PIPE, text=True, check=True)
    code, seconds, megabytes = measured.stdout.split()
    return (float(seconds), float(megabytes)) if code == "0" else None


def cost(program, scan, out):
    return cost_of(program, "ct", scan, "--out", out)


def real_imports(run):
    """In turns with an earlier osteon-import, if OSTEON_EARLIER_IMPORT names one."""
    earlier = os.environ.get("OSTEON_EARLIER_IMPORT")
    values = {}
    for name in SCANS:
        scan = find_scan(run, name)
        if scan is None:
            run.skip(f"import_{name}", "there is no shared/data beside the checkout")
            values |= {f"import_{name}_cpu": Measured(None), f"import_{name}_memory": Measured(None)}
            continue
        run.say(f"importing: {name}")
        programs = {"now": run.programs / "osteon-import"} | ({"earlier": earlier} if earlier else {})
        costs = {which: [] for which in programs}
        for turn in range(9 if run.soak else 3):
            for which, program in programs.items():
                found = cost(program, scan, run.folder / f"import-{name}-{which}-{turn}")
                costs[which] += [found] if found else []
        for i, what in enumerate(("cpu", "memory")):
            now = [c[i] for c in costs["now"]]
            before = float(np.median([c[i] for c in costs["earlier"]])) if costs.get("earlier") else None
            measured = Measured(float(np.median(now)), before, min(now), max(now)) if now else Measured(None)
            values[f"import_{name}_{what}"] = measured
    return values


def use_memory(megabytes):
    """Uses memory and gives it back. A virtual machine gets memory that no program used for a while slowly from its
    host, and Linux counts that time as CPU of the program that asks. Afterwards both sides get it fast."""
    np.ones(int(megabytes * 2**20 / 8))


def against_itk(run, slices, turns):
    """Costs of imports of the trunk phantom and of ITK's chain on the same series, in turns, and its int16 MB."""
    folder = run.folder / f"import-cost-{slices}"
    folder.mkdir(exist_ok=True)
    run.say(f"import and ITK: {slices} slices")
    run.output("osteon-import-cost", "phantom", slices, folder / "series")
    ours, itk = [], []
    volume_mb = slices * 512 * 512 * 2 / 2**20
    for turn in range(turns):
        use_memory(5 * volume_mb)
        found = cost(run.programs / "osteon-import", folder / "series", folder / f"case-{turn}")
        use_memory(5 * volume_mb)
        theirs = cost_of(run.programs / "osteon-import-cost", "itk", folder / "series")
        if found is None or theirs is None:
            return [], [], 0.0
        ours.append(found)
        itk.append(theirs)
        shutil.rmtree(folder / f"case-{turn}")
    shutil.rmtree(folder / "series")
    return ours, itk, volume_mb


def memory_ratio(ours, itk, volume_mb):
    ratios = [memory / volume_mb for _, memory in ours]
    if not ratios:
        return Measured(None)
    return Measured(float(np.median(ratios)), float(np.median([memory / volume_mb for _, memory in itk])),
                    min(ratios), max(ratios))


def import_cost(run):
    ours, itk, volume_mb = against_itk(run, 302, 9 if run.soak else 5)
    values = {"import_peak_memory_ratio": memory_ratio(ours, itk, volume_mb),
              "import_cpu_ratio": Measured(None), "import_trunk_cpu": Measured(None)}
    if ours:
        # Neighbours in time, because other work on the machine changes both.
        ratios = [a / b for (a, _), (b, _) in zip(ours, itk)]
        seconds = [a for a, _ in ours]
        values["import_cpu_ratio"] = Measured(float(np.median(ratios)), None, min(ratios), max(ratios))
        values["import_trunk_cpu"] = Measured(float(np.median(seconds)), float(np.median([b for b, _ in itk])),
                                              min(seconds), max(seconds))
    return values


def import_cost_long(run):
    ours, itk, volume_mb = against_itk(run, 1500, 3 if run.soak else 1)
    return {"import_peak_memory_long": memory_ratio(ours, itk, volume_mb)}


# The scans of osteon-import-accuracy: in the names of figures, and in its output.
ACCURACY_BONES = {"long_bone": "long bone", "two_bones": "two bones"}
ACCURACY_SCANS = {"fine": "fine slices", "noise": "noise", "blur": "blur", "thick": "3 mm slices", "tilted": "tilted",
                  "uneven": "uneven"}


def import_accuracy(run):
    """Dice, distances, densities and masses of imported phantoms. Beside shapes: with the best threshold; beside
    densities and masses: with the blur of cortex taken out. All errors without their sign."""
    run.say("accuracy of imports")
    folder = run.folder / "import-accuracy"
    folder.mkdir(exist_ok=True)
    found = {(row["scan"], row["options"]): row for row in json.loads(run.output("osteon-import-accuracy", folder))}
    values = {}
    for bone, bone_name in ACCURACY_BONES.items():
        for scan, scan_name in ACCURACY_SCANS.items():
            default, best, sharp = (found[f"{bone_name}, {scan_name}", which]
                                    for which in ("default", "midway", "thin cortex"))
            for figure, what in (("dice", "dice"), ("distance", "mean_mm")):
                values[f"import_{bone}_{scan}_{figure}"] = Measured(default[what], best[what])
            for what in ("cortical", "cancellous", "mass"):
                values[f"import_{bone}_{scan}_{what}"] = Measured(abs(default[what + "_percent"]),
                                                                  abs(sharp[what + "_percent"]))
    return values


# Bones of the joints that osteon-phantom-accuracy scans: in the names of figures.
PHANTOM_JOINTS = {"knee": ("femur", "tibia", "fibula", "patella"), "hip": ("hip bone", "femur")}


def phantoms(run):
    """How well phantom bones come back from a simulated CT, and how near a phantom comes to a real femur."""
    run.say("accuracy of phantoms")
    folder = run.folder / "phantoms"
    folder.mkdir(exist_ok=True)
    meshes = run.shared_data("bone-meshes")
    found = json.loads(run.output("osteon-phantom-accuracy", folder, *([meshes / "femur.stl"] if meshes else [])))
    values = {f"phantom_{bone}_dice": Measured(found[bone]["dice"]) for bone in ("femur", "tibia")}
    values |= {f"phantom_femur_{what}": Measured(abs(found["femur"][f"{what}_percent"]))
               for what in ("cortical", "cancellous")}
    values |= {f"phantom_{joint}_{bone.replace(' ', '_')}_dice": Measured(found[joint][bone])
               for joint, bones in PHANTOM_JOINTS.items() for bone in bones}
    values["phantom_force_difference"] = Measured(found["force_percent"])
    if not meshes:
        run.skip("phantom_fit", "there is no shared/data beside the checkout")
    fit = found.get("fit", {})
    return values | {"phantom_fit_distance": Measured(fit.get("distance_mm")),
                     "phantom_fit_sections": Measured(fit.get("sections_percent"))}


def floods():
    """Region growing as a user of SciPy or scikit-image writes it, for those of them that are installed."""
    found = {}
    try:
        from scipy import ndimage

        def scipy_label(scan, low_hu, seed):
            labels, _ = ndimage.label(scan >= low_hu)
            return labels == labels[seed]
        found["SciPy"] = scipy_label
    except ImportError:
        pass
    try:
        from skimage.segmentation import flood
        found["scikit-image"] = lambda scan, low_hu, seed: flood(scan >= low_hu, seed, connectivity=1)
    except ImportError:
        pass
    return found


def region_growing(run):
    """CPU time of one region, beside the fastest of ITK, SciPy and scikit-image. All must give the same voxels."""
    skull = run.example("Cranium.inv3")
    if skull is None:
        run.skip("region_growing", "the package invesalius-examples is not installed")
        return {"region_growing_cpu": Measured(None), "region_growing_speedup": Measured(None)}
    folder = run.folder / "region-growing"
    folder.mkdir(exist_ok=True)
    out = json.loads(run.output("osteon-region-growing", skull, folder))
    scan = np.fromfile(folder / "scan.raw", np.int16).reshape(out["dims"][::-1])
    region = np.fromfile(folder / "region.raw", np.uint8).reshape(scan.shape) != 0
    others, same = {"ITK": out["itk_ms"]}, out["same"]
    for name, grow in floods().items():
        run.say(f"region growing: {name}")
        others[name] = []
        for _ in range(len(out["itk_ms"])):
            start = time.process_time()
            grown = grow(scan, out["low_hu"], tuple(out["seed"][::-1]))
            others[name].append(1e3 * (time.process_time() - start))
        same = same and np.array_equal(grown, region)
    ours, fastest = float(np.median(out["ours_ms"])), min(float(np.median(ms)) for ms in others.values())
    return {"region_growing_cpu": Measured(ours, fastest, min(out["ours_ms"]), max(out["ours_ms"]), 1),
            "region_growing_speedup": Measured(fastest / ours if same else None, None, None, None, 1)}


def case_schemas(run):
    """The cases of two real scans, beside the same bones without their scan in schema 1."""
    values = {}
    for name in ("skull", "tibia"):
        scan = find_scan(run, name)
        names = [f"case_schema_{name}_{what}" for what in ("size", "load", "scan_load")]
        if scan is None:
            run.skip(f"case_schema_{name}", "there is no shared/data beside the checkout")
            values |= {figure: Measured(None) for figure in names}
            continue
        run.say(f"a case and its scan: {name}")
        case = run.folder / f"case-schema-{name}"
        run.output("osteon-import", "ct", scan, "--out", case)
        found = json.loads(run.output("osteon-case-load", case))
        values |= dict(zip(names, (Measured(found["bytes"] / 1e6, found["earlier_bytes"] / 1e6),
                                   Measured(found["load_ms"], found["earlier_load_ms"]),
                                   Measured(found["scan_load_ms"], found["load_ms"]))))
    return values


def scanned_slab(run):
    """The layered block of the rig's figures as DICOM slices, imported at the default threshold."""
    folder = run.folder / "scanned-slab"
    if not folder.exists():
        run.say("a phantom through DICOM")
        folder.mkdir()
        run.output("osteon-import", "phantom", "block", "--layers", LAYERS_MM_DENSITY, "--width", 20, "--pitch", 0.5,
                   "--out", folder / "direct", "--dicom", folder / "series")
        run.output("osteon-import", "ct", folder / "series", "--out", folder / "case")
    return folder / "case"


def slab_volume(run):
    info = json.loads(run.output("osteon-import", "info", "--json", scanned_slab(run)))
    return {"scan_volume_error": (100.0 * abs(info["bone_volume_mm3"] - SLAB_MM3) / SLAB_MM3, None)}
