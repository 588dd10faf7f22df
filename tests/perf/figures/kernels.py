"""Figures of the bone itself, by programs of tests/perf: cutting, surface, accuracy, order of cuts, growth, undo."""
import json
import math
import re
from pathlib import Path

import numpy as np

from registry import Measured

CUT_BUDGET_US = 200.0
TOOL_BUDGET_US = 2000.0


def plain_name(b):
    """A benchmark's name without the suffixes of how it was run."""
    return re.sub(r"/(iterations|repeats|min_time):[0-9.]+|/(manual_time|real_time)", "", b["name"])


def benchmarks(run, pattern):
    """Google Benchmark's counters by name."""
    out = json.loads(run.output("osteon-bench", "--benchmark_format=json", f"--benchmark_filter={pattern}"))
    return {plain_name(b): b for b in out["benchmarks"] if b.get("run_type") != "aggregate"}


def spread(counters, name="ratio", threads=None):
    """A benchmark's counter with its smallest and largest value. No value if the benchmark is missing."""
    return Measured(counters.get(name), None, counters.get(f"{name}_min"), counters.get(f"{name}_max"), threads)


def repeated(run, pattern, repetitions):
    """{name: [counters of each repetition]}. The benchmarks take random turns, so that a lasting disturbance of the
    machine affects all."""
    out = json.loads(run.output("osteon-bench", "--benchmark_format=json", f"--benchmark_filter={pattern}",
                                "--benchmark_min_time=0.1", f"--benchmark_repetitions={repetitions}",
                                "--benchmark_enable_random_interleaving=true"))
    runs = {}
    for b in out["benchmarks"]:
        if b.get("run_type") != "aggregate":
            runs.setdefault(plain_name(b), []).append(b)
    return runs


def over(values, baseline=None, threads=None):
    """The median of several values, with the smallest and the largest."""
    return Measured(float(np.median(values)), baseline, float(min(values)), float(max(values)), threads)


# The baselines of a cut, as osteon-bench names and numbers them.
CUTTERS = {"ours": "Osteon", "dense": "dense array", "leaves": "OpenVDB, culled leaves", "csg": "csgDifference"}
NUMBERED = ("ours", "ours_2", "dense", "dense_2", "leaves", "leaves_2", "csg")


def middle_pass(runs, name):
    """Of several repetitions, the one with the median ratio. Empty if the benchmark is missing."""
    passes = sorted(runs.get(name, [{}]), key=lambda b: b.get("ratio", 0.0))
    return passes[len(passes) // 2]


def cutters(tool, caches, w):
    """Rows of everyone who made the cuts."""
    rows = []
    for who, name in CUTTERS.items():
        for suffix, threads in (("", 1), ("_2", 2)):
            if f"{who}{suffix}_median_us" in w:
                rows.append((tool, caches, name, threads,
                             *(f"{w[f'{who}{suffix}_{key}_us']:.1f}" for key in ("median", "min", "p99", "max"))))
    return rows


def cutting(run):
    """A burr and a drill at work: successive cuts through fresh bone, in turns with the baselines. The same with cold
    caches, each cut at a place of its own. The fastest baseline counts."""
    run.say("cutting, a burr and a drill at work")
    versus = repeated(run, "^cut_(burr|drill)/(work|versus_cold)", 3 if run.soak else 1)
    run.say("cutting with cold caches")
    runs = repeated(run, "^cut_(burr|drill)/cold", 7 if run.soak else 3)
    values = {}
    rows = [("tool", "caches", "way", "threads", "us p50", "min", "p99", "max")]
    for tool in ("burr", "drill"):
        def times(name, key="real_time", tool=tool):
            return np.array([b[key] for b in runs[f"cut_{tool}/{name}"]])
        warm, cold = middle_pass(versus, f"cut_{tool}/work"), middle_pass(versus, f"cut_{tool}/versus_cold")
        fastest = NUMBERED[int(warm["fastest"])]
        values[f"cut_{tool}"] = Measured(warm["ours_median_us"], warm[f"{fastest}_median_us"], warm["ours_min_us"],
                                         warm["ours_max_us"], 1)
        for suffix, threads in (("", 1), ("_2", 2)):
            values[f"cut_{tool}_speedup{suffix}"] = spread(warm, f"ratio{suffix}", threads)
            values[f"cut_{tool}_speedup_cold{suffix}"] = spread(cold, f"ratio{suffix}", threads)
            late = times(f"cold/threads:{threads}", "p99_us")
            values[f"cut_{tool}_cold_p99{suffix}"] = over(late / CUT_BUDGET_US, None, threads)
            values[f"cut_{tool}_cold{suffix}"] = over(times(f"cold/threads:{threads}", "median_us"), None, threads)
            given = times(f"cold_given/threads:{threads}", "p99_us")
            values[f"cut_{tool}_cold_given_p99{suffix}"] = over(given / CUT_BUDGET_US, None, threads)
        rows += cutters(tool, "warm", warm) + cutters(tool, "cold", cold)
    run.tables.append(("cuts of 8 ms in turns; equal bones in the end", rows))

    run.say("cutting with every tool")
    # Of several runs, takes the one with the median 99th percentile, so that other load on the machine does not decide.
    tools = {}
    for name, passes in repeated(run, "^cut_tool/", 7 if run.soak else 5).items():
        _, tool, way, threads = name.split("/")
        middle = sorted(passes, key=lambda b: b["p99_us"])[len(passes) // 2]
        tools.setdefault((tool, way), {})[int(threads.removeprefix("threads:"))] = middle | {
            "max_us": max(b["max_us"] for b in passes)}
    one = {pose: by_threads[1] for pose, by_threads in tools.items()}
    slowest = max(one, key=lambda pose: one[pose]["p99_us"])
    longest = max(one, key=lambda pose: one[pose]["max_us"])
    rows = [("tool", "begins", "mm deep", "pitch mm", "us p50, 1 thread", "p99", "max", "us p50, 2 threads", "p99",
             "max",
             "visited", "computed", "modified", "cuts", "memory kB")]
    for (tool, way), c in sorted(one.items()):
        two = tools[tool, way].get(2, {})
        rows.append((tool, way, f"{c['depth_mm']:g}", f"{c['pitch_mm']:g}",
                     *(f"{c[key]:.0f}" for key in ("median_us", "p99_us", "max_us")),
                     *(f"{two.get(key, math.nan):.0f}" for key in ("median_us", "p99_us", "max_us")),
                     *(f"{c[key]:.0f}" for key in ("visited", "computed", "modified", "cuts")),
                     f"{c['memory_bytes'] / 1e3:.0f}"))
    run.tables.append((f"a cut of 8 ms by every tool that cuts, at its own level, entering bone and seated in it; the "
                       "slowest is "
                       f"{' '.join(slowest)} (p99), the longest single cut {one[longest]['max_us']:.0f} us by "
                       f"{' '.join(longest)}", rows))
    for suffix, threads in (("", 1), ("_2", 2)):
        having = [by_threads[threads] for by_threads in tools.values() if threads in by_threads]
        for figure, key in (("tools_slowest_cut", "p99_us"), ("tools_slowest_cut_p50", "median_us")):
            parts = [c[key] / TOOL_BUDGET_US for c in having]
            values[figure + suffix] = Measured(max(parts), None, min(parts), max(parts),
                                               threads) if parts else Measured(None)
        most = [c["max_us"] for c in having] or [None]
        values[f"tools_longest_cut{suffix}"] = Measured(max(most), None, min(most), max(most), threads)
    values["tools_measured"] = Measured(len({tool for tool, _ in one}))
    return values


def surface(run):
    run.say("surface")
    b = benchmarks(run, "^mesh_")

    def versus(name, caches, threads=1, suffix=""):
        return spread(b.get(f"{name}/{caches}{suffix}", {}), threads=threads)

    whole = {threads: b.get(f"mesh_whole_bone_versus_flying_edges/warm/{threads}", {}) for threads in (1, 2)}
    differences = [abs(w["triangles"] - w["flying_edges_triangles"]) for w in whole.values() if w]
    rows = []
    for caches in ("warm", "cold"):
        frame = b.get(f"mesh_frame_of_33_cuts/{caches}", {})
        parts = [key for key in ("frame_ms", "frame_max_ms", "touch_ms", "blocks_ms", "cuts_ms", "flying_edges_ms",
                                 "blocks", "flying_edges_samples") if key in frame]
        rows += [] if rows else [("caches", *parts)]
        rows.append((caches, *(f"{frame[key]:.3g}" for key in parts)))
    run.tables.append(("a frame of 33 burr cuts: naming its stale blocks (touch) and making them; flying edges on the "
                       "box of what they changed; the cuts are beside it", rows))
    speedups = {}
    for suffix, caches in (("", "warm"), ("_cold", "cold")):
        speedups[f"mesh_block_speedup{suffix}"] = versus("mesh_block_versus_flying_edges", caches)
        speedups[f"mesh_frame_speedup{suffix}"] = versus("mesh_frame_of_33_cuts", caches)
        for threads, number in ((1, ""), (2, "_2")):
            speedups[f"mesh_whole_bone_speedup{suffix}{number}"] = versus(
                "mesh_whole_bone_versus_flying_edges", caches, threads, f"/{threads}")
    return {
        **speedups,
        "mesh_triangle_difference": Measured(int(max(differences)) if differences else None),
        "mesh_bytes_per_triangle": spread(b.get("mesh_bytes_per_triangle_cut", {}), "bytes_per_triangle"),
        "mesh_bytes_per_triangle_bone": spread(b.get("mesh_bytes_per_triangle_bone", {}), "bytes_per_triangle"),
        "mesh_encode": Measured(b["mesh_encode"]["real_time"], b["mesh_flying_edges"]["real_time"]),
        "mesh_decode": Measured(b["mesh_decode"]["real_time"], b["mesh_flying_edges"]["real_time"]),
    }


def convergence_order(pitches, errors):
    """The power of the pitch with which errors fall: slope of the line through their logarithms."""
    return float(np.polyfit(np.log(pitches), np.log(errors), 1)[0])


def accuracy(run):
    """Distances are exact on the samples and linear between them, so smooth bodies converge with the square of the
    pitch."""
    run.say("accuracy")
    out = json.loads(run.output("osteon-accuracy", 300 if run.soak else 60))
    values = {}
    rows = [("body", "tool", "pitch mm", "error % median", "max", "deviation pitches p50", "p99", "max", "vertices")]
    for body in ("sphere", "hole", "kerf"):
        if body not in out:  # no tool of the tool box cuts it
            values |= {f"accuracy_{body}_{what}": Measured(None) for what in ("volume", "order", "surface")}
            continue
        pitches = out[body]["pitches"]
        at = {p["pitch_mm"]: p for p in pitches}
        coarse = [p for p in pitches if p["pitch_mm"] >= 0.125]
        values[f"accuracy_{body}_volume"] = Measured(at[0.125]["error_percent_max"], None,
                                                     at[0.125]["error_percent_min"],
                                                     at[0.125]["error_percent_max"])
        values[f"accuracy_{body}_order"] = Measured(convergence_order([p["pitch_mm"] for p in coarse],
                                                                      [p["error_percent_p50"] for p in coarse]))
        values[f"accuracy_{body}_surface"] = Measured(max(p["deviation_pitches_max"] for p in coarse), None,
                                                      min(p["deviation_pitches_max"] for p in coarse),
                                                      max(p["deviation_pitches_max"] for p in coarse))
        for p in pitches:
            rows.append((body, out[body]["tool"], p["pitch_mm"], f"{p['error_percent_p50']:.4f}",
                         f"{p['error_percent_max']:.4f}",
                         f"{p['deviation_pitches_p50']:.4f}", f"{p['deviation_pitches_p99']:.4f}",
                         f"{p['deviation_pitches_max']:.4f}", p["vertices"]))
    run.tables.append((f"accuracy, {out['trials']} random places and orientations each", rows))
    return values


# Kernels that the same program may choose: samples computed at once, 4 without AVX.
LANES = (4, 8, 16)


# What a build of the kernel may compute at once. A build without AVX has no more than 4 samples in a register.
LANES_OF_BUILD = {"plain": 4, "avx2": 8}


def set_property_run(run, cuts, orders, threads, first=0, program="osteon-set-property", lanes=LANES[-1]):
    kernel = program.removeprefix("osteon-set-property").lstrip("-") or "as built"
    run.say(f"set property: {cuts} cuts, {orders} orders from number {first}, {threads} threads, kernel {kernel}, "
            f"at most {lanes} lanes")
    return json.loads(run.output(program, cuts, orders, threads, first, lanes, progress=True))


def kernels_tried(run, cuts, expected):
    """Kernels of other compilers and settings, and the program's own with fewer lanes, two orders each. Returns how
    many compilers built all three (unoptimised, optimised without AVX, with AVX), how many builds and widths
    there were, and how many differ."""
    programs = sorted(path.name for path in Path(run.programs).glob("osteon-set-property-*"))
    own = [set_property_run(run, cuts, 2, 2, lanes=lanes) for lanes in LANES]
    own = {f"as built, {o['lanes']} lanes": o for o in own}  # a width that the processor lacks repeats another one
    builds = {}
    for program in programs:
        name = program.removeprefix("osteon-set-property-")
        lanes = LANES_OF_BUILD.get(name.split("-")[1], LANES[-1])
        builds[name] = set_property_run(run, cuts, 2, 2, program=program, lanes=lanes)
    ways = {}
    for name in builds:
        compiler, way = name.split("-")
        ways.setdefault(compiler, set()).add(way.rstrip("0123456789"))
    outcomes = own | builds
    differing = [name for name, o in outcomes.items() if o["differing"] or o["name"] != expected]
    run.tables.append((f"kernels, {cuts} cuts in two orders each",
                       [("kernel", "name of the bone", "lanes", "seconds")] + [
        (name, o["name"][:16], o["lanes"], o["seconds"]) for name, o in outcomes.items()]))
    return {"compilers": Measured(sum({"unoptimised", "plain", "avx"} <= had for had in ways.values())),
            "kernels": Measured(len(builds)), "lanes": Measured(len(own)),
            "kernel_differences": Measured(len(differing))}


def orders_tried(run, cuts, orders):
    """As many orders again with two threads as with one, all different. Returns how many gave another bone, and how
    many were distinct."""
    one = set_property_run(run, cuts, orders // 2, 1)
    two = set_property_run(run, cuts, orders - orders // 2, 2, first=orders // 2)
    differing = one["differing"] + two["differing"] + int(one["name"] != two["name"])
    return one, Measured(differing), Measured(len({*one["order_numbers"], *two["order_numbers"]}))


def set_property(run):
    one, differing, orders = orders_tried(run, 300, 20)
    return {
        "set_property_differences": differing,
        "set_property_orders": orders,
        "set_property_partly_cut": Measured(one["partly_cut"]),
        **{f"set_property_{what}": value for what, value in kernels_tried(run, 300, one["name"]).items()},
    }


def set_property_full(run):
    one, differing, orders = orders_tried(run, 10000, 100)
    return {
        "set_property_full_differences": differing,
        "set_property_full_orders": orders,
        "set_property_full_kernel_differences": kernels_tried(run, 10000, one["name"])["kernel_differences"],
    }


def through_zero(x, y):
    """Slope of the line through zero, and the correlation."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    return float(np.dot(x, y) / np.dot(x, x)), float(np.corrcoef(x, y)[0, 1])


def growth(run):
    run.say("growth")
    out = json.loads(run.output("osteon-growth", 128, 256, 512, 1024, progress=True))
    sizes = {s["samples"]: s for s in out["sizes"]}
    # Compares groove by groove: sums of them would rise together in any case.
    burs = []
    rows = [("bur", "grooves", "mm3 least", "mm3 most", "bytes a mm3", "bytes a mm2", "correlation with volume",
             "with area")]
    for bur in out["memory"]:
        area, volume, used = (np.array([g[key] for g in bur["grooves"]]) for key in ("area_mm2", "volume_mm3", "bytes"))
        per_volume, with_volume = through_zero(volume, used)
        per_area, with_area = through_zero(area, used)
        burs.append({"tool": bur["tool"], "area": area, "volume": volume, "bytes": used, "per_volume": per_volume,
                     "per_area": per_area, "with_volume": with_volume})
        rows.append((bur["tool"], len(used), f"{volume.min():.1f}", f"{volume.max():.1f}", f"{per_volume:.0f}",
                     f"{per_area:.0f}",
                     f"{with_volume:.4f}", f"{with_area:.4f}"))
    both = {key: np.concatenate([b[key] for b in burs]) for key in ("volume", "area", "bytes")}
    fits = [through_zero(both[key], both["bytes"]) for key in ("volume", "area")]
    rows.append(("both", len(both["bytes"]), "", "", *(f"{slope:.0f}" for slope, _ in fits),
                 *(f"{fit:.4f}" for _, fit in fits)))
    import pictures  # uses matplotlib, which no other group needs
    pictures.growth(out, burs, run.folder / "growth.png")
    run.tables.append(("memory that each groove adds, slopes through zero", rows))
    run.tables.append((f"growth, {out['sizes'][0]['cuts']} cuts of {out['tool']} in each bone, in turn; picture: "
                       f"{run.folder / 'growth.png'}",
                       [("samples", "us p50", "us p99", "over 128^3", "bytes a cut", "bone MB")] + [
                           (f"{s['samples']}^3", f"{s['us_p50']:.1f}", f"{s['us_p99']:.1f}", f"{s['ratio_p50']:.3f}",
                            f"{s['bytes_per_cut']:.0f}", f"{s['bone_bytes'] / 1e6:.1f}") for s in out["sizes"]]))
    largest = sizes[max(sizes)]
    return {
        **{f"growth_cut_{n}": Measured(sizes[n]["ratio_p50"], None, sizes[n]["ratio_min"], sizes[n]["ratio_max"], 1)
           for n in (256, 512, 1024)},
        "growth_memory_per_volume": Measured(burs[0]["per_volume"]),
        "growth_memory_per_volume_large": Measured(burs[1]["per_volume"]),
        "growth_memory_per_area": Measured(burs[0]["per_area"]),
        "growth_memory_per_area_large": Measured(burs[1]["per_area"]),
        "growth_memory_linear": over([b["with_volume"] for b in burs])._replace(value=min(b["with_volume"]
                                                                                          for b in burs)),
        "growth_memory_bone_ratio": Measured(largest["bytes_per_cut"] / sizes[128]["bytes_per_cut"]),
    }


def undo(run):
    run.say("undo")
    out = json.loads(run.output("osteon-undo", 1000, 40 if run.soak else 15))
    return {
        "undo_leaves": Measured(out["leaves_p50"], None, out["leaves_min"], out["leaves_max"]),
        "undo_time": Measured(out["undo_us_p50"], out["again_us_p50"], out["undo_us_min"], out["undo_us_max"], 1),
        "undo_share": Measured(out["ratio_p50"], None, out["ratio_min"], out["ratio_max"], 1),
        "undo_differences": Measured(out["differing"]),
    }


def of(out, name, beside, threads=None):
    """Values that a program prints as NAME_p50, NAME_min, NAME_max."""
    return Measured(out[f"{name}_p50"], out[f"{beside}_p50"], out[f"{name}_min"], out[f"{name}_max"], threads)


def refinement(run):
    """The dissertation's Table 5.4: method 1 resamples the whole sub-volume that a tool meets, method 2 resamples
    where it cuts."""
    run.say("adaptive resolution")
    out = json.loads(run.output("osteon-refinement-bench"))
    rows = [("resolution, method", "first cut us", "later cuts us", "memory MB", "finest mm in 1 GB", "areas",
             "samples cut")]
    values = {}
    for times in ("2x", "4x"):
        for method in (1, 2):
            name = f"{times}_method{method}"
            rows.append((f"{times}, method {method}", f"{out[f'{name}_first_us_p50']:.0f}",
                         f"{out[f'{name}_later_us_p50']:.0f}",
                         f"{out[f'{name}_megabytes']:.2f}", f"{out[f'{name}_reachable_mm']:.4f}", out[f"{name}_areas"],
                         out[f"{times}_cut_samples"]))
        values |= {
            f"refinement_{times}_first": of(out, f"{times}_method2_first_us", f"{times}_method1_first_us", 1),
            f"refinement_{times}_later": of(out, f"{times}_method2_later_us", f"{times}_method1_later_us", 1),
            f"refinement_{times}_memory_saved": Measured(
                out[f"{times}_method1_megabytes"] / out[f"{times}_method2_megabytes"]),
        }
    values["refinement_differences"] = Measured(sum(out[f"{times}_differing_samples"] for times in ("2x", "4x")))
    run.tables.append(("adaptive resolution, after Table 5.4", rows))
    return values


def collision(run):
    """Section 7.2: segmentation cells (all in, all out or mixed) compared with the distance field."""
    run.say("collision")
    out = json.loads(run.output("osteon-collision-bench"))
    ways = ("nearest", "trilinear", "distance")
    run.tables.append(("collision on a sphere: where a point counts as inside, and what asking costs", [
        ("way", "mean error pitches", "rms", "largest", "ns p50", "min", "max")] + [
        (way, *(f"{out[f'{way}_{what}_pitches']:.4f}" for what in ("mean", "rms", "largest")),
         *(f"{out[f'{way}_ns_{what}']:.1f}" for what in ("p50", "min", "max"))) for way in ways]))
    return {
        **{f"collision_{way}_error": Measured(out[f"{way}_rms_pitches"], None, None, out[f"{way}_largest_pitches"])
           for way in ways},
        **{f"collision_{way}_cost": of(out, f"{way}_ns", "field_ns", 1) for way in ways},
        "collision_distance_gain": Measured(out["nearest_rms_pitches"] / out["distance_rms_pitches"]),
        "collision_cells_memory": Measured(out["cells_bytes"] / out["distance_bytes"]),
    }


def contact(run):
    """Thousands of points of a tool against the bone round it, compared with a dense array and with OpenVDB's
    sampler."""
    run.say("contact")
    out = json.loads(run.output("osteon-contact-bench"))
    run.tables.append((f"contact of {out['points']} points, {out['lanes']} at a time, {100.0 * out['in_bone']:.0f} % "
                       "of them in bone", [
        ("way", "us p50", "min", "max")] + [
        (way, *(f"{out[f'{key}_us_{what}']:.1f}" for what in ("p50", "min", "max")))
        for way, key in (("ours", "contact"), ("dense array", "dense"), ("GridSampler, accessor", "accessor"),
                         ("GridSampler, tree", "tree"), ("ours, cold", "cold_contact"),
                         ("dense array, cold", "cold_dense"), ("GridSampler, accessor, cold", "cold_accessor"))]))
    return {
        "contact_4096": of(out, "contact_us", "dense_us", 1),
        "contact_speedup": Measured(out["speedup_p50"], None, out["speedup_min"], out["speedup_max"], 1),
        "contact_speedup_cold": Measured(out["cold_speedup_p50"], None, out["cold_speedup_min"],
                                         out["cold_speedup_max"], 1),
        "contact_of_budget": Measured(out["contact_us_p50"] / 25.0, None, None, None, 1),
        "contact_difference": Measured(1000.0 * out["largest_difference_mm"]),
        "contact_force_difference": Measured(out["largest_force_difference"]),
    }


FRAME_MS = 1000.0 / 30.0


def real_case(run, name, make_case):
    """A bone from real images, burred in frames of 33 cuts. Skipped with a message if its images are not there."""
    case = run.folder / name
    reason = make_case(case)
    names = ("frame", "frame_budget", "cut_p99", "memory", "memory_cut", "triangle_difference")
    if reason:
        run.skip(f"real_{name}", reason)
        return {f"real_{name}_{what}": Measured(None) for what in names}
    run.say(f"burring {name}")
    vertices, picture = run.folder / f"{name}.vertices", run.folder / f"{name}.png"
    out = json.loads(run.output("osteon-real-case", case, 200 if run.soak else 60, vertices))
    import pictures  # uses matplotlib
    pictures.burred_bone(vertices, out["pitch_mm"], picture)
    vertices.unlink()
    run.tables.append((f"{name}: bone of {'x'.join(map(str, out['samples']))} samples at {out['pitch_mm']:.4g} mm, "
                       "cut at "
                       f"{out['cut_pitch_mm']:.4g} mm; picture: {picture}",
                       [(key, value) for key, value in out.items()]))
    # A frame's whole work, cuts and blocks, compared with the surface of the whole bone by the same mesher.
    return {
        f"real_{name}_frame": Measured(out["frame_ms_p50"], out["whole_ms"], out["frame_ms_min"], out["frame_ms_max"],
                                       1),
        f"real_{name}_frame_budget": Measured(out["frame_ms_p50"] / FRAME_MS, None, out["frame_ms_min"] / FRAME_MS,
                                              out["frame_ms_max"] / FRAME_MS, 1),
        f"real_{name}_cut_p99": Measured(out["cut_us_p99"], out["cut_us_p50"], None, None, 1),
        f"real_{name}_triangle_difference": Measured(out["triangle_difference"], out["triangle_difference_air_apart"]),
        f"real_{name}_memory": Measured(out["case_mb"]),
        f"real_{name}_memory_cut": Measured(out["cut_mb"]),
    }


def real_temporal(run):
    def make(case):
        slices = run.shared_data("temporal-bone-labels")
        if slices is None:
            return "there are no temporal-bone-labels beside this checkout"
        run.say("importing temporal-bone-labels")
        run.output("osteon-import", "labels", slices, "--spacing", "0.0961,0.0961,0.0960", "--out", case)
        return None
    return real_case(run, "temporal", make)


def real_skull(run):
    def make(case):
        skull = run.example("Cranium.inv3")
        if skull is None:
            return "the package invesalius-examples is not installed"
        run.say("importing the skull")
        run.output("osteon-import", "ct", skull, "--out", case)
        return None
    return real_case(run, "skull", make)


GROUPS = {"cutting": cutting, "accuracy": accuracy, "set_property": set_property,
          "set_property_full": set_property_full,
          "growth": growth, "undo": undo, "surface": surface,
          "refinement": refinement, "collision": collision, "contact": contact,
          "real_temporal": real_temporal, "real_skull": real_skull}
