"""Figures of the picture: what its frames cost, and whether it shows the bone as it is. Drawn in software."""
import json

from registry import Measured


def over(a, b):
    """The ratio of two medians."""
    return a["p50"] / b["p50"]


def scene(run):
    frames = 200 if run.soak else 60
    run.say(f"frames of a scene, {frames} of each kind")
    out = json.loads(run.output("osteon-scene-bench", frames))
    kinds = ("at_rest_ms", "changed_ms", "update_ms", "ours_ms", "vtk_ms", "vtk_with_backs_ms")
    run.tables.append((
        f"frames of 1280 x 720: {out['blocks']} blocks in {out['regions']} regions, {out['block_triangles']} "
        f"triangles; and {out['triangles']} triangles",
        [("ms", "median", "min", "max")] + [(kind, *(f"{out[kind][which]:.2f}" for which in ("p50", "min", "max")))
                                            for kind in kinds]))
    return {
        "scene_changed_over_rest": Measured(over(out["changed_ms"], out["at_rest_ms"])),
        "scene_frame_changed": Measured(out["changed_ms"]["p50"], out["at_rest_ms"]["p50"], out["changed_ms"]["min"],
                                        out["changed_ms"]["max"]),
        "scene_rate_over_vtk": Measured(over(out["vtk_ms"], out["ours_ms"])),
        "scene_rate_over_vtk_with_backs": Measured(over(out["vtk_with_backs_ms"], out["ours_ms"])),
        "scene_frame_million": Measured(out["ours_ms"]["p50"], out["vtk_ms"]["p50"], out["ours_ms"]["min"],
                                        out["ours_ms"]["max"]),
    }


def skull(run):
    names = ("cut_pixels", "off_cut_pixels", "seam_jump", "seam_pixels", "outline_apart", "outline_differs")
    cranium = run.example("Cranium.inv3")
    if cranium is None:
        run.skip("picture_skull", "the package invesalius-examples is not installed")
        return {f"picture_skull_{name}": Measured(None) for name in names}
    case, pictures = run.folder / "pictured-skull", run.folder / "skull-pictures"
    run.say("importing the skull")
    run.output("osteon-import", "ct", cranium, "--out", case)
    pictures.mkdir(exist_ok=True)
    run.say("drawing the skull")
    out = json.loads(run.output("osteon-skull-pictures", case, pictures))
    run.tables.append((f"pictures of the skull: {pictures}", list(out.items())))
    return {
        "picture_skull_cut_pixels": Measured(out["cut_pixels"]),
        "picture_skull_off_cut_pixels": Measured(out["off_cut_pixels"]),
        "picture_skull_seam_jump": Measured(out["jump_across_max"] / out["jump_within_max"]),
        "picture_skull_seam_pixels": Measured(out["seam_pixels"]),
        "picture_skull_outline_apart": Measured(100.0 * out["outline_apart"] / out["outline_pixels"]),
        "picture_skull_outline_differs": Measured(100.0 * out["differing"] / out["pixels"]),
    }


def radiology(run):
    """A skull from CT with its soft tissue. Without the example, nothing is measured."""
    source = run.example("Cranium.inv3")
    if source is None:
        run.skip("radiology", "the package invesalius-examples is not installed")
        return {name: Measured(None) for name in ("radiograph_over_vtk", "radiograph_changed_over_whole",
                                                  "slices_over_vtk", "radiograph_difference")}
    turns = 60 if run.soak else 15
    run.say(f"radiographs and slices, {turns} turns")
    case = run.folder / "radiology"
    run.output("osteon-import", "ct", source, "--out", case)
    out = json.loads(run.output("osteon-radiology-bench", case, turns))
    kinds = ("radiograph_ms", "vtk_radiograph_ms", "changed_ms", "slices_ms", "vtk_slices_ms")
    run.tables.append((
        f"a radiograph of 800 x 600, the {out['changed_pixels']} pixels that a cut changed, and three slices of 512 x "
        f"512; {out['samples']} samples, {out['memory_mb']:.0f} MB",
        [("ms", "median", "min", "max")] + [(kind, *(f"{out[kind][which]:.3f}" for which in ("p50", "min", "max")))
                                            for kind in kinds]))
    return {
        "radiograph_over_vtk": Measured(over(out["radiograph_ms"], out["vtk_radiograph_ms"])),
        "radiograph_changed_over_whole": Measured(over(out["changed_ms"], out["radiograph_ms"])),
        "slices_over_vtk": Measured(over(out["slices_ms"], out["vtk_slices_ms"])),
        "radiograph_difference": Measured(out["difference"]),
    }


GROUPS = {"scene": scene, "picture_skull": skull, "radiology": radiology}
