"""Every number that this project promises, by name: what it measures, in which unit, and what it must be.

A figure is decided ("ok" or "short") only when it is a ratio, a count or a bound; absolute times depend on the machine
and are printed as "info", beside a baseline that was measured on the same machine in the same run."""
from dataclasses import dataclass
from typing import Optional


@dataclass(frozen=True)
class Figure:
    name: str
    unit: str
    measures: str
    group: str                      # what produces it, see groups.py; a group runs once for all of its figures
    target: Optional[tuple] = None  # (comparison, bound); None: information
    baseline: str = ""              # what `baseline` is; empty: there is none

    def verdict(self, value):
        if self.target is None:
            return "info"
        comparison, bound = self.target
        return "ok" if value is not None and COMPARISONS[comparison](value, bound) else "short"

    def target_text(self):
        return "-" if self.target is None else f"{self.target[0]}{self.target[1]:g}"


COMPARISONS = {
    "<=": lambda value, bound: value <= bound,
    ">=": lambda value, bound: value >= bound,
    "==": lambda value, bound: value == bound,
}

EMPTY_LOOP = "the same of an empty 1 kHz loop"

FIGURES = [
    # The haptic loop, in the rig session: all four programs on this machine.
    Figure("haptic_work_p50", "us", "work of the haptic loop in a tick, median", "rig", baseline=EMPTY_LOOP),
    Figure("haptic_work_p99", "us", "work of the haptic loop in a tick, 99th percentile", "rig", baseline=EMPTY_LOOP),
    Figure("haptic_late_p50", "us", "lateness of the haptic loop's ticks, median", "rig", baseline=EMPTY_LOOP),
    Figure("haptic_late_p99", "us", "lateness of the haptic loop's ticks, 99th percentile", "rig", baseline=EMPTY_LOOP),
    Figure("haptic_missed_ticks", "per_10000", "periods that no tick ran in, per 10000 ticks", "rig",
           baseline=EMPTY_LOOP),
    Figure("patch_build_p50", "us", "gathering the bone round the tool for the haptic loop, median", "rig"),
    Figure("patch_build_p99", "us", "gathering the bone round the tool for the haptic loop, 99th percentile", "rig"),
    # How quickly the others learn of a cut.
    Figure("cut_to_commit_p50", "ms", "from a cut's end until its confirmation, median", "rig"),
    Figure("mesh_update_p50", "ms", "from a cut's end until the viewer has the new surface, median", "rig",
           baseline="period of the mesh stream"),
    Figure("mesh_update_p99", "ms", "from a cut's end until the viewer has the new surface, 99th percentile", "rig",
           baseline="period of the mesh stream"),
    Figure("cut_to_picture_p50", "ms", "from a cut's end until the viewer has drawn it, median", "rig",
           baseline="period of the mesh stream"),
    Figure("cut_to_picture_p99", "ms", "from a cut's end until the viewer has drawn it, 99th percentile", "rig",
           baseline="period of the mesh stream"),
    Figure("cut_to_sound_p50", "ms", "from a cutting state until it is in the sound, median", "rig"),
    Figure("cut_to_sound_p99", "ms", "from a cutting state until it is in the sound, 99th percentile", "rig"),
    # What the physics must be, phantom 5/20/5 mm at 1.9/0.3/1.9 g/cm3, drill 3.2 mm, 1000 rpm.
    Figure("rig_force_cortical_error", "percent", "thrust in the cortical layers at 1 mm/s against Chi's law (28.9 N)",
           "rig", ("<=", 5.0)),
    Figure("rig_force_medullary_error", "percent", "thrust in the medullary layer at 1 mm/s against Chi's law (3.25 N)",
           "rig", ("<=", 5.0)),
    Figure("rig_force_after_exit", "n", "largest thrust once the drill's cone has left the bone", "rig", ("<=", 0.01)),
    Figure("rig_removed_volume_error", "percent", "bone removed by the rig against the drill's closed form", "rig",
           ("<=", 2.0)),
    Figure("feed_medullary_over_cortical", "ratio", "expert hand: feed in the medullary layer over the cortical one",
           "expert", (">=", 10.0), baseline="of the reference simulation"),
    Figure("plunge_expert", "mm", "expert hand: how far the tip goes beyond the far face", "expert",
           baseline="of the reference simulation"),
    Figure("plunge_expert_error", "percent", "the same against the reference simulation", "expert", ("<=", 15.0)),
    Figure("plunge_novice", "mm", "novice hand: how far the tip goes beyond the far face", "novice",
           baseline="of the reference simulation"),
    Figure("plunge_novice_error", "percent", "the same against the reference simulation", "novice", ("<=", 15.0)),
    Figure("plunge_novice_over_expert", "ratio", "novice's plunge over the expert's", "novice", (">=", 1.5),
           baseline="of the reference simulation"),
    # Agreement of all holders of the bone, over every session of this run.
    Figure("field_hash_differences", "count", "sessions after which server and haptic client held different bone", "rig",
           ("==", 0)),
    Figure("mesh_hash_differences", "count", "viewers, one of them late, that held another surface than the server at the end", "rig",
           ("==", 0)),
    # Kernels.
    Figure("cut_burr", "us", "applying a 5 mm burr's cut of 8 ms at 0.125 mm", "bench",
           baseline="voxel by voxel through an OpenVDB accessor"),
    Figure("cut_drill", "us", "applying a 3.2 mm drill's cut of 8 ms at 0.125 mm", "bench",
           baseline="voxel by voxel through an OpenVDB accessor"),
    Figure("mesh_encode", "us", "making one block of surface with its bytes", "bench",
           baseline="vtkFlyingEdges3D on the same samples"),
    Figure("mesh_decode", "us", "rebuilding one block of surface from its bytes", "bench",
           baseline="vtkFlyingEdges3D on the same samples"),
    Figure("mesh_bytes_per_triangle", "bytes", "size of a block on the wire per triangle", "bench"),
]


def by_name(names):
    """The figures of these names, or all; ValueError names the first unknown one."""
    known = {figure.name: figure for figure in FIGURES}
    for name in names:
        if name not in known:
            raise ValueError(f"there is no figure '{name}'; deploy/figures --list shows all")
    return [known[name] for name in names] if names else list(FIGURES)
