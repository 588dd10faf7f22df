"""Every number that this project promises, by name: what it measures, its unit, and its target.

A figure has a verdict ("ok" or "short") only if it is a ratio, a count or a bound. Absolute times depend on the
machine and are printed as "info", beside a baseline that was measured on the same machine in the same run."""
from dataclasses import dataclass
from typing import NamedTuple, Optional


class Measured(NamedTuple):
    """A group's result for a figure: its value, usually a median, with its baseline and conditions."""
    value: object
    baseline: object = None
    low: object = None              # smallest and largest of the values that `value` stands for
    high: object = None
    threads: Optional[int] = None


@dataclass(frozen=True)
class Figure:
    name: str
    unit: str
    measures: str
    # the group that produces it, see groups.py; a group runs once for all of its figures
    group: str
    target: Optional[tuple] = None  # (comparison, bound); None: for information
    baseline: str = ""              # what `baseline` is; empty: none
    full: bool = False              # takes minutes: measured only if it is named, or if all figures are requested

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

# What tests/perf/baselines has: written to be fast, and shown to do the same work.
STRANGERS = "the fastest of a dense array, OpenVDB's culled leaves and csgDifference"
ITK_CHAIN = "ITK's, which reads, applies the threshold, labels, resamples and measures distances, but saves nothing"
FILTERS = "the fastest of SciPy, scikit-image and ITK"
SHARP_CORTEX = "with --thin-cortex on, and skin at which the blur is measured"
EMPTY_LOOP = "the same of an empty 1 kHz loop"
# Target of fuzz.mutations, what is changed in it, which code takes that, and number of inputs; ten million of each with
# --soak.
# A million if each input costs a millisecond, because the bone is cut, or SQLite opens a file three times and salvages
# it.
FUZZED = (
    ("ticket", "tickets", "the authorizer", 10_000_000),
    ("upload", "archives", "the upload validation", 10_000_000),
    ("supervision", "decisions", "the wire", 10_000_000),
    ("annotation", "drawings", "the wire", 10_000_000),
    ("up_packet", "datagrams, and packets with the key,", "the server's end of a fast path", 10_000_000),
    ("down_packet", "datagrams, and packets with the key,", "the client's end of a fast path", 10_000_000),
    ("requests", "requests of all calls together", "the wire", 10_000_000),
    ("calls", "requests of all calls together", "a server with a room", 10_000_000),
    ("journal_entries", "entries of journals, many in each input,", "a room", 10_000_000),
    ("journal_entries_evaluated", "entries of journals, many in each input,", "a room with its bone", 1_000_000),
    ("journal_genesis", "beginnings of rooms", "a room", 10_000_000),
    ("journal_file", "files of journals", "verify, salvage and open", 1_000_000),
)
INSIDER_WAYS = (("", ""), ("_proxied", ", through the proxy"))
INSIDER_ATTACKS = (("killing", "send a header that once ended the server"),
                   ("resets", "begin and reset 20000 calls over a connection"))
HOURS_OF = ("osteon", "osteon-server", "osteon-haptic", "osteon-audio")  # the window and its children
# Bounds of SNR, PSD, mel bands and envelope: about what sms-tools 1.2.1 reaches, and less for the hammer.
SOUND_MODELS = {"drill": (7.5, 1.8, 2.1, 0.65), "saw": (6.0, 3.4, 2.4, 0.9), "hammer": (7.6, 3.4, 2.5, 1.0)}
# What a listener hears, and in which words; bounds of the share of frames at 20 and 6 dB.
SOUND_LISTENERS = (("spectrum", "the sound", {20: 0.95, 6: 0.85}),
                   ("equal_rms", "the sound, all windows of 50 ms at one level", {}),
                   ("level_only", "the level alone", {}))
SOUND_TRUTHS = (("accuracy", "share of frames of 10 ms that are named rightly"),
                ("mean_recall", "mean of the five classes' shares of frames that are named rightly"),
                ("transitions", "share of changes of class that are named within 50 ms"))
MACHINE = "a thread that wakes 20 times a second and syncs 4 KB to the disk, in the same runs"

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
    # How quickly the other clients receive a cut.
    Figure("cut_to_commit_p50", "ms", "from a cut's end until its confirmation, median", "rig"),
    Figure("mesh_update_p50", "ms", "from a cut's end until the viewer has the new surface, median", "rig",
           baseline="period of the mesh stream"),
    Figure("mesh_update_p99", "ms", "from a cut's end until the viewer has the new surface, 99th percentile", "rig",
           baseline="period of the mesh stream"),
    Figure("cut_to_picture_p50", "ms", "from a cut's end until the viewer has drawn it, median", "rig",
           baseline="period of the mesh stream"),
    Figure("cut_to_picture_p99", "ms", "from a cut's end until the viewer has drawn it, 99th percentile", "rig",
           baseline="period of the mesh stream"),
    Figure("cut_to_picture_frames_p50", "frames", "the median, less a period of the mesh stream, over the viewer's "
           "median frame in the same run", "rig", ("<=", 1.5), baseline="the whole time, ms"),
    Figure("cut_to_picture_frames_p99", "frames", "the same of the 99th percentile, over the same frame", "rig",
           ("<=", 3.0), baseline="the whole time, ms"),
    Figure("rig_frame_p50", "ms", "the viewer's frame of 640 x 480 meanwhile, in software, median", "rig",
           baseline="99th percentile"),
    Figure("cut_to_sound_p50", "ms", "from a cutting state until it is in the sound, median", "rig"),
    Figure("cut_to_sound_p99", "ms", "from a cutting state until it is in the sound, 99th percentile", "rig"),
    Figure("sound_analysis_speed", "times_real_time", "length of a recording of 30 s at 48 kHz over the time of its "
           "analysis, without files", "sound_analysis", (">=", 20.0)),
    *[Figure(f"sound_binaural_{name}_speed", "times_real_time", f"length of a scripted drilling over the processor's "
             f"time of its synthesis for headphones, with a tool that {what}", "sound_binaural", (">=", 100.0))
      for name, what in (("still", "stays at one place"), ("moving", "turns, and its filters in each block"))],
    Figure("sound_model_speed", "times_real_time", "length of the same recording over the processor's time of its "
           "spectral model, without refinement", "sound_model", (">=", 20.0)),
    Figure("sound_model_refined_speed", "times_real_time", "the same with two rounds of refinement", "sound_model",
           (">=", 4.0)),
    *[figure for name, bounds in SOUND_MODELS.items() for figure in (
        Figure(f"sound_model_{name}_snr", "db", f"recording of a {name}: its power over that of its difference from "
               "the partials with their phases", "sound_model", (">=", bounds[0])),
        Figure(f"sound_model_{name}_psd", "db", f"model of a {name}: RMS difference of the power spectral densities",
               "sound_model", ("<=", bounds[1])),
        Figure(f"sound_model_{name}_mel", "db", f"model of a {name}: RMS difference of the energies of mel bands",
               "sound_model", ("<=", bounds[2])),
        Figure(f"sound_model_{name}_envelope", "db", f"model of a {name}: RMS difference of the levels of 10 ms",
               "sound_model", ("<=", bounds[3])))],
    # What 8.5.4 says of drilling, on the synthesised sound. 3 dB are an obvious difference (8.6.3).
    *[Figure(f"tool_sound_{name}", unit, measures, "tool_sound", target) for name, unit, measures, target in (
        ("cancellous", "db", "level of drilling cancellous bone over running free", (">=", 3.0)),
        ("cortical", "db", "level of drilling cortical bone over cancellous bone", (">=", 3.0)),
        ("perforation", "db", "level of 0.1 s of perforation over cortical bone", (">=", 3.0)),
        ("burst_off", "hz", "distance of the strongest line of perforation from 200 Hz", ("<=", 30.0)),
        ("motor_in_cortical", "db", "the motor's line over its gear's in cortical bone", (">=", 1.0)),
        ("gear_in_cancellous", "db", "the gear's line over the motor's in cancellous bone", (">=", 1.0)),
        ("low_band", "db", "rise of 0 to 400 Hz from free to cancellous and from there to cortical, the smaller one",
         (">=", 3.0)),
        ("low_half", "ratio", "energy in A1 of the wavelet packets, the least of all states", (">=", 0.6)),
        ("shift_error", "percent", "largest difference of a line's fall under load from 1.8 %", ("<=", 0.05)),
        ("speed", "times_real_time", "length of the sound of a drill over the processor's time of its synthesis",
         (">=", 100.0)))],
    # Silent, free, cortical, cancellous and perforation, told by a classifier that never heard the seed, speed or tool.
    # Smallest and largest: of the sets of other drillings, other speeds and each other tool.
    *[Figure(f"sound_classes_{listener}_{truth}_{snr}db", "share", f"{what} by {heard}, white noise {snr} dB below the "
             "tool", "sound_classes", (">=", bounds[snr]) if truth != "transitions" and bounds else None)
      for listener, heard, bounds in SOUND_LISTENERS for truth, what in SOUND_TRUTHS for snr in (20, 6)],
    # Played to a sink without a card, whose monitor is recorded. While gaps are looked for, threads that give way to
    # all others keep the processors awake.
    Figure("sound_output_compared", "ratio", "of ten minutes of a drilling over headphones, with processors that never "
           "sleep, the part that was compared", "sound_output", (">=", 0.99), full=True),
    Figure("sound_output_gaps", "count", "runs of silence in what came out of the sink that nobody rendered",
           "sound_output", ("==", 0), baseline="gaps by the output's own clock", full=True),
    Figure("sound_output_gaps_without_stall", "count", "of them, those during which no processor stood still",
           "sound_output", ("==", 0), baseline="stalls of a processor, 5 ms or more", full=True),
    Figure("sound_output_differing", "count", "frames that came out and differ from those rendered in any bit, and "
           "those rendered that did not come out", "sound_output", ("==", 0), full=True),
    Figure("sound_output_share", "ratio", "most processor time of the callback's thread from one call to the next, "
           "over the duration of a buffer", "sound_output", ("<=", 0.5), baseline="99th percentile", full=True),
    Figure("sound_output_share_without_stall", "ratio", "the most of those calls during which no processor stood "
           "still for 1.5 ms or more", "sound_output", ("<=", 0.5),
           baseline="part of the calls that this leaves out", full=True),
    Figure("sound_output_allocations", "count", "allocations in the callback", "sound_output", ("==", 0),
           baseline="in its thread, with those of RtAudio and libpulse", full=True),
    Figure("sound_latency_p50", "ms", "from the server's acceptance of a cut to its first changed sample on the "
           "monitor, median of 300 cuts; the way to the server is left out", "sound_latency", full=True),
    Figure("sound_latency_p95", "of_budget", "95th percentile of them as a part of 24 ms, the just noticeable "
           "difference of touch and sound [A]", "sound_latency", ("<=", 1.0), baseline="the time, ms", full=True),
    Figure("sound_latency_p99", "ms", "99th percentile of them", "sound_latency", baseline="the longest", full=True),
    Figure("sound_latency_unheard", "count", "of them, those without a sound", "sound_latency", ("==", 0), full=True),
    # Required physics: phantom 5/20/5 mm at 1.9/0.3/1.9 g/cm3, drill 3.2 mm, 1000 rpm.
    Figure("rig_force_cortical_error", "percent", "thrust in the cortical layers at 1 mm/s against Chi's law (28.9 N)",
           "rig", ("<=", 3.0)),
    Figure("rig_force_medullary_error", "percent", "thrust in the medullary layer at 1 mm/s against Chi's law (3.25 N)",
           "rig", ("<=", 3.0)),
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
    # The same on virtual time with a simulated device, and what changes it. Also guides and burrs.
    Figure("feel_rig_cortical_error", "percent",
           "feed rig on virtual time: thrust in the cortical layers against 28.9 N",
           "feel_rig", ("<=", 3.0)),
    Figure("feel_rig_medullary_error", "percent",
           "feed rig on virtual time: thrust in the medullary layer against 3.25 N",
           "feel_rig", ("<=", 3.0)),
    Figure("feel_rig_force_ratio", "ratio", "thrust in the cortical layers over that in the medullary one", "feel_rig",
           (">=", 8.0)),
    Figure("feel_rig_ramp_error", "ratio",
           "way of the tip while more and more of its point is in bone (by the root of the "
           "engaged share) against the cone's height, as a part of half the drill's pitch", "feel_rig", ("<=", 1.0)),
    Figure("feel_rig_after_exit", "n", "largest thrust once the cone has left the bone", "feel_rig", ("==", 0)),
    Figure("feel_expert_plunge_error", "percent", "expert's plunge on virtual time against 6.0 mm", "feel_hands",
           ("<=", 15.0)),
    Figure("feel_novice_plunge_error", "percent", "novice's plunge on virtual time against 14.4 mm", "feel_hands",
           ("<=", 15.0)),
    Figure("feel_plunge_closed_form_error", "percent",
           "how far the tip goes after the cone's exit against F/K + F/K_c, either "
           "hand", "feel_hands", ("<=", 15.0)),
    Figure("feel_plunge_wrong_ways", "count",
           "of eight sweeps (push, wear, stiffness and damping of the hand; expert, novice) "
           "those in which the plunge does not rise with push and wear and fall with stiffness and damping",
           "feel_hands",
           ("==", 0)),
    Figure("feel_tick_change", "percent",
           "largest change of any force, feed and plunge of rig, expert and novice at 0.5 and "
           "2 kHz against 1 kHz", "feel_steps", ("<=", 3.0)),
    Figure("feel_pitch_change", "percent", "the same with a bone at 0.25 and 1 mm against one at 0.5 mm", "feel_steps",
           ("<=", 3.0)),
    Figure("feel_burring_force", "n", "mean force while a round burr takes 0.5 mm off cortical bone", "feel_profiles"),
    Figure("feel_milling_force", "n", "mean force while it mills a slot of 2.5 mm, in passes", "feel_profiles"),
    Figure("feel_guided_excess", "mm",
           "how far the cuts of a trembling hand through a sleeve lie beyond its play c (1 + 2 L / "
           "L_sleeve); paths of cuts are simplified by up to 0.01 mm", "feel_guided", ("<=", 0.01), baseline="by eye"),
    Figure("feel_guided_of_play", "ratio",
           "how far the drill itself gets off the planned line, as a part of that play and a "
           "pose's quantum", "feel_guided", ("<=", 1.0), baseline="by eye"),
    # The force laws by themselves.
    Figure("laws_listed", "count", "force laws that can be chosen", "laws", (">=", 9)),
    Figure("laws_chi_error", "percent", "Chi's thrust at 0.3 to 2.0 g/cm3, 1000 rpm, 1 mm/s, against the points of "
           "comparison, which have two or three digits", "laws", ("<=", 2.0)),
    Figure("laws_allotta_thrust_error", "percent", "Allotta's thrust of drills of 2.5 to 7.94 mm against the same",
           "laws",
           ("<=", 0.2)),
    Figure("laws_allotta_torque_error", "percent", "Allotta's torque of the same drills", "laws", ("<=", 0.2)),
    Figure("laws_allotta_energy_error", "ratio", "work of Allotta's torque for each mm3 of the hole over K_s, less one",
           "laws",
           ("<=", 1e-9)),
    Figure("laws_fitted_error", "percent",
           "spring-damper and multi-point thrust at the cortical point that they are fitted to",
           "laws", ("<=", 1.0)),
    Figure("laws_inverse_error", "ratio", "feed of every law's force at its point, against the feed of that point",
           "laws",
           ("<=", 1e-9)),
    Figure("laws_allotta_over_chi", "ratio", "how much the two drilling laws disagree in cortical bone", "laws",
           baseline="of the reference page"),
    # Agreement of all holders of the bone, over every session of this run.
    Figure("field_hash_differences", "count", "sessions after which server and haptic client held different bone",
           "rig",
           ("==", 0)),
    Figure("mesh_hash_differences", "count",
           "viewers, one of them late, that held another surface than the server at the end",
           "rig", ("==", 0)),
    # Cutting at 0.125 mm: working cuts of a haptic client (8 ms). Each continues from the one before, into fresh bone.
    # Single threads unless stated otherwise.
    *[figure for tool, what, least, least_cold in (
        ("burr", "a 3.2 mm burr going sideways, half immersed", 0.5, 0.35),
        ("drill", "a 3.5 mm drill going straight in", 0.7, 0.4))
      for figure in (
        Figure(f"cut_{tool}", "us", f"one cut of {what}, at 0.125 mm", "cutting", baseline=STRANGERS),
        Figure(f"cut_{tool}_speedup", "ratio",
               f"{what}: {STRANGERS}, over ours, for the same cuts in turns, one thread each; below 1 ours is slower",
               "cutting", (">=", least)),
        Figure(f"cut_{tool}_speedup_2", "ratio", "the same with two threads for ours, and one or two for the others",
               "cutting", (">=", least)),
        Figure(f"cut_{tool}_speedup_cold", "ratio",
               f"{what}, every cut at a place of its own, 96 MiB written before every cut to empty the caches: the "
               "fastest but csgDifference, over ours, one thread each", "cutting", (">=", least_cold)),
        Figure(f"cut_{tool}_speedup_cold_2", "ratio",
               "the same with two threads for ours, and one or two for the others", "cutting", (">=", least_cold)),
        *[figure for suffix, threads in (("", "one thread"), ("_2", "two threads")) for figure in (
            Figure(f"cut_{tool}_cold_p99{suffix}", "of_budget",
                   f"{what}, every cut at a place of its own at least 7 mm from all "
                   f"others, so that each leaf it changes is new, {threads}, 96 MiB written before every cut to empty "
                   "the "
                   "caches; memory reserved between cuts as the server does: 99th percentile as a part of 200 us",
                   "cutting",
                   ("<=", 1.0)),
            Figure(f"cut_{tool}_cold_given_p99{suffix}", "of_budget",
                   "the same without that reserve: the system gives the "
                   "memory for new leaves page by page while it cuts", "cutting"),
            Figure(f"cut_{tool}_cold{suffix}", "us", "median of the former", "cutting"))])],
    Figure("tools_slowest_cut", "of_budget",
           "the slowest of the cutting tools, each at its own level, entering bone and seated "
           "in it with all of its cutting part, the worse of both: 99th percentile as a part of 2 ms", "cutting",
           ("<=", 1.0)),
    Figure("tools_slowest_cut_2", "of_budget", "the same with two threads", "cutting", ("<=", 1.0)),
    Figure("tools_slowest_cut_p50", "of_budget", "the slowest by the median, as a part of 2 ms", "cutting"),
    Figure("tools_slowest_cut_p50_2", "of_budget", "the same with two threads", "cutting"),
    Figure("tools_longest_cut", "us", "the longest single cut of all tools in all passes", "cutting"),
    Figure("tools_longest_cut_2", "us", "the same with two threads", "cutting"),
    Figure("tools_measured", "count", "cutting tools in that list; 21 of Appendix B's 24 cut", "cutting", (">=", 21)),
    # The surface.
    Figure("mesh_block_speedup", "ratio", "gathering a burred block, its marching cubes and normals: time of "
           "vtkFlyingEdges3D on its samples over ours", "surface", (">=", 2.5)),
    Figure("mesh_block_speedup_cold", "ratio", "the same with cold caches", "surface", (">=", 2.0)),
    *[Figure(f"mesh_whole_bone_speedup{suffix}", "ratio", f"the same for a whole bone, {what}", "surface", target)
      for suffix, what, target in (
          ("", "one thread each", (">=", 1.6)), ("_2", "two threads each", (">=", 1.4)),
          ("_cold", "one thread each, cold caches", (">=", 1.6)),
          ("_cold_2", "two threads each, cold caches", (">=", 1.4)))],
    Figure("mesh_triangle_difference", "count", "triangles of the whole bone that vtkFlyingEdges3D has more or fewer",
           "surface", ("==", 0)),
    Figure("mesh_frame_speedup", "ratio",
           "vtkFlyingEdges3D on the box of what a frame of 33 burr cuts changed, its samples ready in a dense image, "
           "over what the frame costs our surface: naming its stale blocks, gathering and encoding them; below 1 ours "
           "is slower", "surface", (">=", 0.08)),
    Figure("mesh_frame_speedup_cold", "ratio", "the same with cold caches", "surface", (">=", 0.1)),
    Figure("mesh_bytes_per_triangle", "bytes", "a burred block on the wire per triangle", "surface", ("<=", 2.2)),
    Figure("mesh_bytes_per_triangle_bone", "bytes", "a whole bone on the wire per triangle", "surface"),
    Figure("mesh_encode", "us", "making one block of surface with its bytes", "surface",
           baseline="vtkFlyingEdges3D on the same samples"),
    Figure("mesh_decode", "us", "rebuilding one block of surface from its bytes", "surface",
           baseline="vtkFlyingEdges3D on the same samples"),
    # The picture: frames of 1280 x 720 in software, in turns in one run. Copies of changed meshes are in the times.
    Figure("scene_changed_over_rest", "ratio", "a frame after five of 500 blocks all over a bone changed, over one of "
           "the same bone at rest", "scene", ("<=", 1.1)),
    Figure("scene_frame_changed", "ms", "the former, median", "scene", baseline="at rest"),
    Figure("scene_rate_over_vtk", "ratio", "frames a second of a million triangles over those of VTK alone, with one "
           "mapper and the same light, that leaves out back faces too", "scene", (">=", 0.9)),
    Figure("scene_rate_over_vtk_with_backs", "ratio", "the same, with back faces as VTK draws them unasked", "scene"),
    Figure("scene_frame_million", "ms", "a frame of a million triangles, median", "scene",
           baseline="VTK alone, without back faces"),
    # Radiographs of 800 x 600 and three slices of 512 x 512, on one thread each, in turns in one run.
    Figure("radiograph_over_vtk", "ratio", "a whole radiograph of a skull over one of VTK's fixed-point ray caster, "
           "with samples as far apart as voxels", "radiology", ("<=", 0.7)),
    Figure("radiograph_changed_over_whole", "ratio", "bringing HU and radiograph up to date after a drill's cut of "
           "8 ms, over a whole radiograph", "radiology", ("<=", 0.02)),
    Figure("slices_over_vtk", "ratio", "three slices over those of vtkImageReslice", "radiology", ("<=", 0.5)),
    Figure("radiograph_difference", "ratio", "mean difference of both radiographs, of the photons that get through",
           "radiology", ("<=", 0.02)),
    # Simulated operators who drill beside a window, every second one while the pedal of its C-arm is held.
    Figure("c_arm_missed", "per_10000", "periods that no tick of the haptic loop ran in, per 10000 ticks, while the "
           "C-arm of a window on the same machine is live", "haptic_c_arm",
           baseline="with a hidden C-arm, in turns in the same run", full=True),
    Figure("c_arm_missed_more", "sigma", "how many more they are than with a hidden C-arm, over what such counts "
           "scatter by", "haptic_c_arm", ("<=", 3.0), full=True),
    Figure("c_arm_shots", "count", "X-rays that were shot meanwhile; without them the former would prove nothing",
           "haptic_c_arm", (">=", 40), full=True),
    Figure("c_arm_late_p99", "us", "lateness of ticks meanwhile, 99th percentile, median of all operators",
           "haptic_c_arm", baseline="with a hidden C-arm", full=True),
    # The page of image processing with a DICOM folder of 512 x 512 x 302 voxels.
    Figure("imaging_first_slice", "ratio", "time from the folder to its first slice on the page, the middle one with "
           "all its HU, over that of GDCM, which reads all headers and decodes all slices once, in turns; the page "
           "has read all headers and decoded this slice by then, and decodes the others behind it",
           "imaging_page", ("<=", 1.5), full=True),
    Figure("imaging_first_slice_time", "s", "the former, median", "imaging_page", baseline="GDCM", full=True),
    Figure("imaging_three_planes_time", "s", "time from the folder until all slices are read and three planes "
           "drawn, median", "imaging_page", baseline="GDCM", full=True),
    Figure("imaging_memory", "ratio", "growth of the page's process from before a scan is open to its peak, over the "
           "scan's int16 voxels, while bones are kept, painted, cut and filtered, and all is undone and done again",
           "imaging_page", ("<=", 2.5), full=True),
    Figure("imaging_memory_whole", "ratio", "that peak itself, with the program and its libraries, over the voxels",
           "imaging_page", baseline="before a scan is open", full=True),
    Figure("imaging_memory_with_importer", "ratio", "the same together with osteon-import, its child", "imaging_page",
           baseline="the page alone, before a scan is open", full=True),
    # An hour of drilling, undo and saving in the real window: resident memory by a line through all rounds after ten
    # minutes. In rooms: the case is closed and opened in each round. In a room: it stays open, and all is undone.
    *[Figure(f"window_{kind}_{program.removeprefix('osteon-')}", "percent",
             f"growth of {program} in an hour at the window, of its size after ten minutes, {how}", f"window_{kind}",
             ("<=", 5.0), full=True)
      for kind, how in (("rooms", "the case opened in each round"), ("room", "in a room that stays open"))
      for program in HOURS_OF],
    # A skull with a groove from eight sides, coarse where nobody looks or works, beside the same in full.
    Figure("picture_skull_off_cut_pixels", "count", "pixels of a cut's colour farther from the tool's way than a cell "
           "of the bone", "picture_skull", ("==", 0)),
    Figure("picture_skull_cut_pixels", "count", "pixels of a cut's colour on the cut; without them the former would "
           "prove nothing", "picture_skull", (">=", 1000)),
    Figure("picture_skull_seam_jump", "ratio", "largest turn of the shaded normal from a pixel to the next where two "
           "levels of detail meet, over the largest within a level", "picture_skull", ("<=", 2.0)),
    Figure("picture_skull_seam_pixels", "count", "pairs of pixels where that was measured", "picture_skull",
           (">=", 1000)),
    Figure("picture_skull_outline_differs", "percent", "pixels that show bone with coarse parts or in full, and not in "
           "the other picture, nor beside there", "picture_skull", ("<=", 0.1)),
    Figure("picture_skull_outline_apart", "percent", "pixels of both outlines that are farther than one pixel from the "
           "other", "picture_skull"),
    # Accuracy of cuts at random positions and orientations. The worst trial decides.
    *[figure for body,
      what in (("sphere", "a sphere cut by the 3.2 mm burr"), ("hole", "a hole drilled through a slab"),
                                ("kerf", "a saw's kerf through a shaft")) for figure in (
        Figure(f"accuracy_{body}_volume", "percent", f"volume of {what} at 0.125 mm against its closed form",
               "accuracy",
               ("<=", 0.5)),
        Figure(f"accuracy_{body}_order", "order",
               f"the same error's rate: it falls with the pitch to this power, 0.5 to "
               "0.125 mm", "accuracy", (">=", 1.5)),
        Figure(f"accuracy_{body}_surface", "pitches", f"largest distance of vertices from {what}, away from edges",
               "accuracy", ("<=", 0.15)))],
    # The bone is a function of the set of its cuts.
    Figure("set_property_differences", "count",
           "random orders with repeats, of 300 random cuts of all tools, that gave "
           "another bone", "set_property", ("==", 0)),
    Figure("set_property_orders", "count", "distinct orders tried for that, half with one thread, half with two",
           "set_property", ("==", 20)),
    Figure("set_property_partly_cut", "ratio",
           "samples of that bone between uncut and gone; without them it would prove "
           "nothing", "set_property", (">=", 0.1)),
    Figure("set_property_compilers", "count",
           "compilers that built the kernel unoptimised, optimised without AVX, and with AVX",
           "set_property", (">=", 2)),
    Figure("set_property_kernels", "count", "builds of the kernel by those compilers, two orders each", "set_property",
           (">=", 6)),
    Figure("set_property_lanes", "count",
           "widths of the program's own kernel (samples computed at once), two orders each",
           "set_property", (">=", 2)),
    Figure("set_property_kernel_differences", "count", "of builds and widths, those that gave another bone",
           "set_property",
           ("==", 0)),
    Figure("set_property_full_differences", "count",
           "100 orders with repeats, of 10000 random cuts of all tools, half with "
           "one thread, half with two, that gave another bone", "set_property_full", ("==", 0), full=True),
    Figure("set_property_full_orders", "count", "distinct orders tried for that", "set_property_full", ("==", 100),
           full=True),
    Figure("set_property_full_kernel_differences", "count",
           "kernels that gave another bone for these cuts, two orders each",
           "set_property_full", ("==", 0), full=True),
    # Growth.
    *[Figure(f"growth_cut_{size}", "ratio", f"a burr's cut in a bone of {size}^3 samples over the same in 128^3",
             "growth",
             ("<=", 1.25)) for size in (256, 512, 1024)],
    *[Figure(f"growth_memory_per_{what}{suffix}", "bytes",
             f"memory that grooves of a {bur} mm bur add to the cut field, per "
             f"{unit}, slope through zero", "growth") for what, unit in (("volume", "mm3 of bone that they remove"),
                                                                ("area", "mm2 of surface that they cut"))
      for bur, suffix in (("3.2", ""), ("6", "_large"))],
    Figure("growth_memory_linear", "ratio",
           "correlation of the memory that a groove adds with the volume it removes, groove by "
           "groove, the lower of two burs", "growth", (">=", 0.95)),
    Figure("growth_memory_bone_ratio", "ratio", "memory of a cut in the largest bone over the smallest, cuts scattered",
           "growth"),
    # Undo.
    Figure("undo_leaves", "count", "leaves rebuilt to take one of 1000 burr cuts back, median", "undo"),
    Figure("undo_time", "us", "taking one of 1000 burr cuts back, median", "undo",
           baseline="applying all the others again"),
    Figure("undo_share", "ratio", "time to take one cut back over that of applying all the others again", "undo",
           ("<=", 0.1)),
    Figure("undo_differences", "count", "bones that were not as if the cut had never been made", "undo", ("==", 0)),
    # Adaptive resolution: method 1 resamples a whole sub-volume. Method 2, ours, resamples where the tool cuts (Table
    # 5.4).
    *[figure for times in ("2x", "4x") for figure in (
        Figure(f"refinement_{times}_first", "us", f"cuts that reach new bone at {times} resolution, method 2",
               "refinement",
               baseline="method 1"),
        Figure(f"refinement_{times}_later", "us", f"later cuts at {times} resolution, method 2", "refinement",
               baseline="method 1"),
        Figure(f"refinement_{times}_memory_saved", "ratio",
               f"memory of method 1 over that of method 2 at {times} resolution",
               "refinement"))],
    Figure("refinement_differences", "count",
           "samples on which the bone that is read from method 1's resampled sub-volumes "
           "differs from that of method 2, both resolutions", "refinement",
           ("==", 0)),
    # Collision by segmentation cells (7.2) and by the distance field, on a sphere.
    *[figure for way, what in (("nearest", "cells, the nearest voxel of a mixed one"),
                               ("trilinear", "cells, mixed ones trilinear"), ("distance", "distance field"))
      for figure in (
        Figure(f"collision_{way}_error", "pitches", f"{what}: where a point counts as inside, rms and largest error",
               "collision"),
        Figure(f"collision_{way}_cost", "ns", f"{what}: asking for one point", "collision",
               baseline="the cut field's own grids"))],
    Figure("collision_distance_gain", "ratio", "error of cells with the nearest voxel over that of the distance field",
           "collision", (">=", 1.0)),
    Figure("collision_cells_memory", "ratio", "memory of the cells over that of the distance field's samples",
           "collision"),
    # Contact of a tool of 4096 points in the haptic loop: distances, normals, density, force and torque in one pass.
    Figure("contact_4096", "us",
           "one collision and force evaluation of 4096 points with density, median with warm caches",
           "contact", baseline="the same on dense arrays, vectorised"),
    Figure("contact_speedup", "ratio",
           "the faster of dense arrays, vectorised, and OpenVDB's GridSampler (BoxSampler, through an accessor) with "
           "central differences, over ours, in turns", "contact", (">=", 0.6)),
    Figure("contact_speedup_cold", "ratio", "the same with cold caches", "contact", (">=", 0.8)),
    Figure("contact_of_budget", "of_budget", "the same evaluation as a part of 25 us", "contact", ("<=", 1.0)),
    Figure("contact_difference", "um", "largest difference of any of them in distance near the surface", "contact",
           ("<=", 1.0)),
    Figure("contact_force_difference", "ratio",
           "largest difference of any of them in force and torque, against their size",
           "contact", ("<=", 0.01)),
    # The coupling between hand and tool on simulated devices: a million ticks on virtual time, with other cuts and
    # undone bone under the tool, and 0 to 200 ms to the room.
    # Energies at the handle are computed from outside. The same again on devices that show torque, with a hand that
    # tilts its tool by up to 15 degrees.
    *[figure for prefix, on in (("stability", ""), ("stability_six", "six axes: ")) for figure in (
        Figure(f"{prefix}_ticks", "count",
               f"{on}ticks of stroking, pressing into a cavity and a thin wall, burring and drilling",
               "haptic_stability", (">=", 1_000_000), full=True),
        Figure(f"{prefix}_contacts", "count", f"{on}contacts in them", "haptic_stability", (">=", 1000), full=True),
        Figure(f"{prefix}_undone", "count", f"{on}cuts that were taken back meanwhile", "haptic_stability",
               (">=", 1000),
               full=True),
        Figure(f"{prefix}_worst_contact", "mj",
               f"{on}most that the coupling gave in one contact, to the hand and to cutting, "
               "beyond what the hand put in", "haptic_stability", ("<=", 0.01), full=True),
        Figure(f"{prefix}_generated", "mj", f"{on}the same over all contacts that gave anything", "haptic_stability",
               ("<=", 1.0), full=True),
        Figure(f"{prefix}_net", "mj", f"{on}what all contacts gave together; negative: what the coupling took",
               "haptic_stability", ("<=", 0.0), baseline="less the work of cutting", full=True),
        Figure(f"{prefix}_cutting_power", "n_mm",
               f"{on}least product of cutting force and way of the tool in any tick: never "
               "negative by construction, as ticks that would make it so count as rubbing", "haptic_stability",
               (">=", 0.0),
               full=True),
        Figure(f"{prefix}_pushed_back", "percent",
               f"{on}such ticks, in which the tool turned back by more than it cut, to those "
               "that cut: so few that means over cutting ticks hold to a hundredth", "haptic_stability", ("<=", 1.0),
               full=True),
        Figure(f"{prefix}_pushed_back_most", "mj",
               f"{on}the most that the cutting force would have given in one of them; it is "
               "not shown", "haptic_stability", full=True),
        Figure(f"{prefix}_step", "n",
               f"{on}growth of force in a tick beyond the slew limit and what the hand's motion explains",
               "haptic_stability", ("<=", 1e-9), full=True),
        Figure(f"{prefix}_step_still", "n", f"{on}growth of force in a tick while the hand stood still",
               "haptic_stability",
               ("<=", 0.5000001), full=True),
        Figure(f"{prefix}_fall", "n",
               f"{on}fall of force in a tick beyond the same, but for breakthroughs and safety zeros: the "
               "monitor's doing", "haptic_stability", full=True),
        Figure(f"{prefix}_late", "count", f"{on}ticks that came so late that no force was shown", "haptic_stability",
               (">=", 1000), full=True),
        Figure(f"{prefix}_motor_excess", "n",
               f"{on}the motor's force beyond s mu F_n, orbiting in a cavity and elsewhere",
               "haptic_stability", ("<=", 1e-9), full=True),
        Figure(f"{prefix}_motor_late", "n", f"{on}the motor's force later than 10 ms after the pedal",
               "haptic_stability",
               ("==", 0), full=True),
        Figure(f"{prefix}_motor_largest", "n", f"{on}the motor's largest force", "haptic_stability", full=True),
        Figure(f"{prefix}_thin_wall", "mm", f"{on}how deep a burr was pressed into a wall of 1 mm that it does not cut",
               "haptic_stability", ("<=", 0.3), full=True),
        Figure(f"{prefix}_allocations", "count", f"{on}heap allocations of all these ticks", "haptic_stability",
               ("==", 0),
               full=True))],
    Figure("stability_six_turned", "mj", "what the hand put in by turning alone", "haptic_stability", full=True),
    Figure("stability_six_torque_step", "n",
           "growth of torque in a tick, over the arm of a turn, beyond the slew limit and what "
           "the hand's motion explains", "haptic_stability", ("<=", 1e-9), full=True),
    Figure("stability_six_torque_excess", "nmm",
           "torque beyond the device's limit, or of the cut beyond the force at the arm "
           "of a turn", "haptic_stability", ("<=", 1e-9), full=True),
    Figure("stability_six_torque_late", "nmm", "the cut's own torque later than 10 ms after the pedal",
           "haptic_stability",
           ("==", 0), full=True),
    Figure("stability_six_torque_largest", "nmm", "the largest torque", "haptic_stability", full=True),
    # Two users push a bone on its compliant mount against each other, on virtual time: connections of 0, 50 and 150 ms
    # one way, and 0 ms for one user with 150 ms for the other. All but the first have 30 ms of jitter and 30 % loss.
    *[figure for line, what in (("0", "lines without delay"), ("50", "lines of 50 ms"), ("150", "lines of 150 ms"),
                                ("0_and_150", "a line without delay and one of 150 ms")) for figure in (
        Figure(f"mount_rest_error_{line}ms", "percent",
               f"{what}: largest error of what either feels of the other at rest, "
               "against the closed form of two springs on the mount", "haptic_mount", ("<=", 5.0), baseline="mean",
               full=True),
        Figure(f"mount_rests_{line}ms", "count", f"{what}: pushes at whose ends that was measured", "haptic_mount",
               (">=", 30),
               full=True))],
    Figure("mount_ticks", "count",
           "ticks over each of these lines, of hands that push, that never rest, and that are three "
           "times as stiff", "haptic_mount", (">=", 1_000_000), full=True),
    Figure("mount_made_of_allowance", "ratio",
           "most that the bones shown ever gave both hands beyond what both put in, over "
           "what they are allowed to, once", "haptic_mount", ("<=", 1.000001), full=True),
    Figure("mount_account", "mj", "what clients tell of energy against the work reckoned from outside", "haptic_mount",
           ("<=", 1e-3), full=True),
    Figure("mount_growth", "ratio", "largest force in the second half of the ticks over that in the first",
           "haptic_mount",
           ("<=", 1.5), full=True),
    Figure("mount_uncontrolled", "mj", "what the stiff hands would be given without the controller", "haptic_mount",
           (">=", 100.0), baseline="most with it", full=True),
    # The whole tick, and the loop with a network that falls silent for 10 s.
    *[figure for work, what in (
        ("drill", "drilling with a 3.2 mm drill"), ("burr", "burring with a 5 mm burr"), ("pin", "driving a pin"),
        ("saw", "sawing with a wide blade"), ("saw_narrow", "sawing with a narrow blade")) for figure in (
        Figure(f"tick_{work}", "of_budget", f"a whole tick of the haptic loop while {what}: median as a part of 60 us",
               "haptic_tick", ("<=", 1.0)),
        Figure(f"tick_{work}_p50", "us", "the same, median", "haptic_tick"),
        Figure(f"tick_{work}_p99", "us", "the same, 99th percentile", "haptic_tick"))],
    # A hand that rocks, twists and pulls a turning tool from side to side in its own cut.
    *[figure for tool in ("pin", "saw") for figure in (
        Figure(f"tick_{tool}_wedged", "of_budget", f"a {tool} wedged in its own cut: median tick as a part of 60 us",
               "haptic_tick", ("<=", 1.0)),
        Figure(f"tick_{tool}_wedged_p50", "us", "the same, median", "haptic_tick"),
        Figure(f"tick_{tool}_wedged_p99", "us", "the same, 99th percentile", "haptic_tick"),
        Figure(f"tick_{tool}_wedged_late", "of_period", "the same as a part of the 1000 us that a tick has",
               "haptic_tick",
               ("<=", 1.0)))],
    Figure("blackout_missed", "per_10000",
           "periods that no tick ran in, per 10000 ticks, while the network is silent for 10 s",
           "haptic_blackout", baseline="before and after, in the same run"),
    Figure("blackout_missed_more", "sigma",
           "how many more they are than before and after, over what such counts scatter by",
           "haptic_blackout", ("<=", 3.0)),
    Figure("blackout_late_p99", "us", "lateness of ticks meanwhile, 99th percentile", "haptic_blackout",
           baseline="before and after, in the same run"),
    # Devices on an emulated USB.
    Figure("falcon_cycles", "count", "frames each way with an emulated Falcon", "falcon_cycles", (">=", 100000),
           full=True),
    Figure("falcon_cycle_faults", "count", "of them, spoilt ones and those that gave another place than the grip's",
           "falcon_cycles", ("==", 0), full=True),
    Figure("falcon_unplug_faults", "count",
           "of ten unpluggings in between, those unnoticed or followed by force once it was "
           "there again", "falcon_cycles", ("==", 0), full=True),
    Figure("falcon_cycle_rate", "per_s", "cycles a second that the emulation gives", "falcon_cycles", full=True),
    # A room that loses nothing: simulated, and with real processes.
    Figure("simulated_seeds", "count", "small rooms simulated with bad networks, disks and crashes", "simulated",
           (">=", 10_000), full=True),
    Figure("simulated_failures", "count", "of them, those that broke an invariant", "simulated", ("==", 0), full=True),
    Figure("simulated_acknowledged", "count", "entries acknowledged in them", "simulated", full=True),
    Figure("simulated_crashes", "count", "servers that crashed in them", "simulated", full=True),
    Figure("simulated_cpu", "of_budget", "processor time of such a room, median, as a part of 50 ms", "simulated",
           ("<=", 1.0), full=True),
    Figure("simulated_full_seeds", "count", "larger rooms simulated at up to 30 % loss, with splits", "simulated_full",
           (">=", 300), full=True),
    Figure("simulated_full_failures", "count", "of them, those that broke an invariant", "simulated_full", ("==", 0),
           full=True),
    Figure("simulated_full_settled", "of_budget",
           "longest virtual time from quiet until all held one bone, as a part of 2 s",
           "simulated_full", ("<=", 1.0), full=True),
    Figure("simulated_breakages_missed", "count", "rules that can be broken on purpose without that a seed fails",
           "simulated_broken", ("==", 0), full=True),
    Figure("simulated_breakage_least", "count", "of 300 seeds, those that fail for the rule that is missed most often",
           "simulated_broken", full=True),
    Figure("journal_trials", "count", "journals whose power or disk failed", "journal", (">=", 4000)),
    Figure("journal_acknowledged", "count", "entries acknowledged in them", "journal", (">=", 100_000)),
    Figure("journal_lost", "count", "of these entries, those lost or different", "journal", ("==", 0)),
    Figure("journal_bad_trials", "count", "trials with anything that must not be", "journal", ("==", 0)),
    Figure("journal_not_durable_lost", "count", "entries lost in 100 trials without waiting for the disk", "journal",
           (">=", 1)),
    Figure("journal_damage_trials", "count", "killed journals of which one file was damaged", "journal",
           (">=", 10_000)),
    Figure("journal_damage_silent", "count", "of them, those that lost something in silence", "journal", ("==", 0)),
    Figure("journal_damage_only_log_silent", "count", "the same where the log has no mirror, of a tenth as many",
           "journal", (">=", 1)),
    Figure("journal_kill_trials", "count", "journals killed or without power at a write or sync, and not damaged",
           "journal", (">=", 3900)),
    Figure("journal_false_alarms", "count", "of them, those called damaged or with entries lost", "journal", ("==", 0)),
    *[Figure(f"journal_commit_{name}_{per_commit}", "ratio", f"{what}, {per_commit} entries of 150 bytes a commit",
             "journal_commits", ("<=", most), baseline="the earlier program named by OSTEON_EARLIER_JOURNAL")
      for per_commit, bytes_most in ((1, 0.5), (4, 0.334)) for name, what, most in (
          ("p50", "wait for a commit, median", 1.3), ("p99", "the same, 99th percentile", 1.3),
          ("bytes", "bytes written for an entry, the database's too", bytes_most))],
    Figure("server_kills", "count", "servers killed at work", "server_kills", (">=", 2000), full=True),
    Figure("server_kills_acknowledged", "count", "cuts that they had acknowledged", "server_kills", (">=", 20_000),
           full=True),
    Figure("server_kills_lost", "count", "of them lost, kept twice, left out, or holders with another bone",
           "server_kills",
           ("==", 0), full=True),
    Figure("server_kills_back", "ms",
           "from a server's return until both hands stood in its room again, median, in the slowest of "
           "four rooms", "server_kills", full=True),
    Figure("bad_network_runs", "count", "real rooms at 40 +- 10 ms, 30 % loss, 10 % reorder, 5 % duplication",
           "bad_network",
           (">=", 50), full=True),
    Figure("bad_network_faults", "count", "of them not converged, and cuts not decided", "bad_network", ("==", 0),
           full=True),
    Figure("bad_network_converged", "of_budget", "longest time from quiet until all held one bone, as a part of 2 s",
           "bad_network", ("<=", 1.0), full=True),
    Figure("felt_loopback_p99", "of_budget",
           "from one hand's sending of a cut until the other's patch has it, as a part of 25 ms: 99th percentile of "
           "the cuts of "
           "all runs; min, max: of the median and of the worst run", "bad_network", ("<=", 1.0), baseline=MACHINE,
           full=True),
    Figure("felt_bad_p99", "of_budget", "the same at 40 +- 10 ms and 30 % loss, as a part of 150 ms", "bad_network",
           ("<=", 1.0), baseline=MACHINE, full=True),
    # The time of each stage, on the loopback.
    *[Figure(f"felt_stage_{stage}", "ms", f"{what}, median", "felt_stages", baseline="at 40 +- 10 ms and 30 % loss",
             full=True)
      for stage, what in (
          ("uplink", "from sending a cut until the server has it"), ("wait_for_tick", "until its tick begins"),
          ("decide", "until it is decided and applied"), ("commit", "until it is on the disk and told"),
          ("downlink", "until the other has it"), ("replica_and_patch", "until it is in the other's replica and patch"),
          ("all", "all of these together"))],
    Figure("felt_stage_close", "ms", "from a motion until its cut closes, at most, by construction", "felt_stages",
           baseline="at 40 +- 10 ms and 30 % loss", full=True),
    # An instructor's decision.
    Figure("freeze_p99", "of_budget",
           "from the answer to an instructor who stops a hand until its loop cuts no more, less the "
           "time of the way, 99th percentile of the worst of 0, 50 and 150 ms one way, as a part of two ticks of the "
           "server, "
           "16.7 ms", "override", ("<=", 1.0), baseline="median", full=True),
    Figure("freeze_p99_loss", "of_budget", "the same with 30 % of the datagrams lost", "override", baseline="median",
           full=True),
    Figure("freeze_missing", "count", "words that stopped no hand before the next, on all these lines", "override",
           ("==", 0),
           full=True),
    Figure("override_force_step", "ratio",
           "largest growth of force in a tick that the hand did not cause, of hands that are "
           "stopped, taken over, given back, limited, led and undone under at 0, 50 and 150 ms, on bone that stands "
           "and on a mount, "
           "over the slew limit", "override", ("<=", 1.000001), baseline="on the mount", full=True),
    Figure("override_energy", "ratio",
           "most that one contact, or the pull of a leading hand, gave such a hand beyond what it "
           "got, as a part of 0.01 mJ", "override", ("<=", 1.0), baseline="on the mount", full=True),
    Figure("override_mount_made", "ratio",
           "most that a bone on its mount gave such a hand and another user, who pushes it "
           "suddenly, beyond what both put in, over what they are allowed to, once", "override", ("<=", 1.0),
           full=True),
    Figure("override_mount_carried", "mm", "way of such a bone under tools that touched it, least of the three delays",
           "override",
           (">=", 50.0), full=True),
    Figure("override_in_contact", "count",
           "times that each of these took hold of a tool on bone: the rarest, at the delay and on "
           "the bone where it was rarest", "override", (">=", 5), full=True),
    # Authentication.
    Figure("knocks", "count", "unauthenticated clients while a haptic client works: silent, in plain HTTP/2, noise, "
           "TLS without a certificate", "knocking", (">=", 100_000), full=True),
    Figure("knocks_let_in", "count", "of them answered but by a refusal, or not hung up on", "knocking", ("==", 0),
           full=True),
    Figure("knocks_noticed", "count",
           "of 60 at a door without TLS, left open on purpose, those that this count says were let in",
           "knocking", (">=", 50), full=True),
    Figure("knocks_memory", "mb", "what the server's memory grew by meanwhile", "knocking", ("<=", 64.0),
           baseline="its memory before", full=True),
    Figure("knocks_logged", "count", "lines that its log says of them; of none of them it would be a failure",
           "knocking", ("<=", 20),
           full=True),
    Figure("knocks_commit", "ms", "from a cut of the hand until it is confirmed, median, meanwhile", "knocking",
           baseline="before they came", full=True),
    Figure("knocks_differences", "count", "hands with another bone than the server's at the end", "knocking", ("==", 0),
           full=True),
    Figure("damaged_cases", "count", "uploads of a case with one to three bytes changed, ten of them of 65 MB",
           "damaged_cases", (">=", 1000), full=True),
    Figure("damaged_cases_taken", "count", "of them taken as another case", "damaged_cases", ("==", 0), full=True),
    Figure("damaged_cases_memory", "mib", "most memory of a process that looked one through", "damaged_cases",
           ("<=", 1024), full=True),
    Figure("damaged_cases_sentence", "bytes", "longest sentence of why one was refused", "damaged_cases", ("<=", 4100),
           full=True),
    # Attackers with a valid certificate, with a revoked one, and without one: four connections at a time for 24
    # seconds, at a lower priority on the same machine, while another person calls.
    *[Figure(f"insider{way}_{attack}_p99", "ratio",
             f"a person's calls, 99th percentile, while others {what}{through}, over the same "
             f"before and after; the worst of a valid, a revoked and no certificate",
             "insiders", ("<=", 2.0), full=True)
      for way, through in INSIDER_WAYS for attack, what in INSIDER_ATTACKS],
    *[figure for way, through in INSIDER_WAYS for figure in (
        Figure(f"insider{way}_memory", "mib", f"most that memory grew by in one of these attacks{through}",
               "insiders", ("<=", 128.0), full=True),
        Figure(f"insider{way}_unnamed", "count",
               f"of these attacks{through}, those of which no log says who it was and from where",
               "insiders", ("==", 0), full=True))],
    Figure("proxy_upload_ratio", "ratio",
           "time to send 32 MiB to the server over that through the proxy, at a round trip of 150 ms "
           "(a relay that delays both directions and bounds nothing)", "insider_uploads", (">=", 0.8), full=True),
    *[Figure(f"fuzzed_{target}", "count", f"changed {what} that {take} took or refused, and nothing else",
             f"fuzz_{target}",
             (">=", inputs), full=True) for target, what, take, inputs in FUZZED],
    Figure("simulated_decisions", "count", "decisions of instructors about hands in the simulated rooms", "simulated",
           (">=", 10_000), full=True),
    Figure("simulated_forbidden", "count", "cuts that were refused for them; one that was taken would be a failure",
           "simulated",
           full=True),
    # The load of one tool on its connection and its room's disk.
    Figure("uplink_cutting", "kbit_per_s", "a tool's uplink while it cuts: sealed datagrams and the stream's bytes and "
           "acknowledgements, headers included", "uplink", ("<=", 300.0), full=True),
    Figure("uplink_cutting_loss", "kbit_per_s", "the same at 40 +- 10 ms and 30 % loss", "uplink", ("<=", 300.0),
           baseline="without loss", full=True),
    Figure("uplink_idle_share", "ratio",
           "uplink of a tool that rests over that of one that cuts, on the worse of both lines",
           "uplink", ("<=", 0.2), full=True),
    Figure("journal_mb_per_hour", "mb",
           "journal of a tool that cuts for an hour without pause, from a shorter time, and one "
           "checkpoint", "uplink", full=True),
    Figure("rooms_per_core", "count",
           "rooms that a core holds with a tool cutting in each and a journal on the disk, viewers and "
           "lines to clients not counted; of 1, 4 or 16 rooms in one process the most that keep their ticks",
           "rooms_per_core",
           baseline="without journals", full=True),
    Figure("forged", "count", "datagrams forged, flipped or replayed", "forgery", (">=", 10_000_000), full=True),
    Figure("forged_accepted", "count", "of them accepted", "forgery", ("==", 0), full=True),
    Figure("forged_answered", "count", "bytes answered to them", "forgery", ("==", 0), full=True),
    Figure("genuine_lost", "count", "genuine datagrams in between that were not accepted", "forgery", ("==", 0),
           full=True),
    Figure("observers_p99", "of_budget",
           "from a cut's commit until each of 150 observers has its surface, 99th percentile, as a part of "
           "40 ms", "observers", ("<=", 1.0), baseline="10 observers", full=True),
    Figure("observers_stalled_p99", "of_budget", "the same of the others while ten never read", "observers",
           ("<=", 1.0),
           full=True),
    Figure("observers_stalled_effect", "ratio", "what ten stalled ones do to the others", "observers", ("<=", 1.25),
           full=True),
    Figure("observers_rate", "ratio", "messages a second that the slowest observer gets, over 30", "observers",
           (">=", 0.95),
           full=True),
    Figure("observers_there", "count", "of three runs, those after which all had the newest surface", "observers",
           ("==", 3),
           full=True),
    Figure("observers_memory", "ratio", "memory of the server with ten stalled ones over that without", "observers",
           ("<=", 1.1), full=True),
    # The result of an import of a scan, and its cost.
    Figure("scan_volume_error", "percent", "volume of the phantom scanned and imported at the default threshold, "
           "against its own", "scan", ("<=", 2.0)),
    Figure("scan_force_cortical_error", "percent", "thrust of the rig in its cortex, both layers, against the law's",
           "scan", ("<=", 5.0)),
    Figure("scan_force_medullary_error", "percent", "the same in its cancellous bone", "scan", ("<=", 5.0)),
    *[figure for name, what in (("skull", "a skull of 108 slices"), ("tibia", "two lower legs of 46 slices"),
                                ("body", "a trunk of 20 slices")) for figure in (
        Figure(f"import_{name}_cpu", "s", f"CPU time of the import of {what}", "real_imports",
               baseline="the earlier program named by OSTEON_EARLIER_IMPORT"),
        Figure(f"import_{name}_memory", "mb", f"peak memory of the import of {what}", "real_imports",
               baseline="the earlier program"))],
    # How well an imported bone agrees with the shape that was scanned: Dice of their samples, and the mean distance of
    # their surfaces, both ways. Pixels are 0.7 mm. Densities are means at least 1 mm from the faces of a layer.
    *[figure for bone, bone_name, least in (("long_bone", "a long bone", 0.97),
                                            ("two_bones", "two bones 2 mm apart", 0.95))
      for scan, scan_name, most in (("fine", "slices 1 mm apart", 0.35), ("noise", "noise of 80 HU", 0.35),
                                    ("blur", "a blur of 0.7 mm", 0.35), ("thick", "slices of 3 mm", 0.6),
                                    ("tilted", "a gantry tilted by 20 degrees", 0.35),
                                    ("uneven", "slices 1 to 3 mm apart", 0.35)) for figure in (
        Figure(f"import_{bone}_{scan}_dice", "ratio", f"Dice of {bone_name} and its import, {scan_name}",
               "import_accuracy", (">=", least), "with a threshold midway between soft tissue and cortex"),
        Figure(f"import_{bone}_{scan}_distance", "mm", f"mean distance of their surfaces, {scan_name}",
               "import_accuracy", ("<=", most), "with a threshold midway between soft tissue and cortex"),
        Figure(f"import_{bone}_{scan}_cortical", "percent",
               f"error of the density within the cortex of {bone_name}, {scan_name}", "import_accuracy", ("<=", 3.0),
               SHARP_CORTEX),
        Figure(f"import_{bone}_{scan}_cancellous", "percent",
               f"error of the density within its cancellous bone, {scan_name}", "import_accuracy", ("<=", 5.0),
               SHARP_CORTEX),
        Figure(f"import_{bone}_{scan}_mass", "percent", f"error of its mass, {scan_name}", "import_accuracy",
               baseline=SHARP_CORTEX))],
    # Phantom bones through a simulated CT: slices of 3 mm, tilted by 12 degrees, noise of 30 HU, a blur of 0.5 mm.
    *[Figure(f"phantom_{bone}_dice", "ratio", f"Dice of {what} and its import", "phantoms", (">=", 0.97))
      for bone, what in (("femur", "a phantom femur"), ("tibia", "a phantom tibia with its fibula"))],
    Figure("phantom_femur_cortical", "percent", "error of the density within cortex of that femur", "phantoms",
           ("<=", 3.0)),
    Figure("phantom_femur_cancellous", "percent", "the same of its cancellous bone", "phantoms", ("<=", 5.0)),
    *[Figure(f"phantom_{joint}_{bone}_dice", "ratio", f"Dice of the {bone.replace('_', ' ')} of a phantom {joint}, "
             "grown from seeds", "phantoms", (">=", 0.95))
      for joint, bones in (("knee", ("femur", "tibia", "fibula", "patella")), ("hip", ("hip_bone", "femur")))
      for bone in bones],
    Figure("phantom_force_difference", "percent", "mean difference of the thrust along a hole through a phantom femur "
           "and through the import of its scan, of the mean thrust", "phantoms", ("<=", 10.0)),
    Figure("phantom_fit_distance", "mm", "mean distance of a real femur and the phantom fitted to it, the larger one "
           "of both ways", "phantoms", ("<=", 3.0)),
    Figure("phantom_fit_sections", "percent", "largest difference of areas and second moments of their sections, from "
           "20 to 75 % of the length", "phantoms", ("<=", 15.0)),
    Figure("import_trunk_cpu", "s", "CPU time from a DICOM folder of a trunk, 512 x 512 x 302, to its saved case",
           "import_cost", baseline=ITK_CHAIN),
    Figure("import_cpu_ratio", "ratio", f"the same over that of {ITK_CHAIN}, in turns", "import_cost", ("<=", 1.2)),
    Figure("import_peak_memory_ratio", "ratio", "its peak memory over the scan's int16 voxels", "import_cost",
           ("<=", 2.5), baseline=ITK_CHAIN),
    Figure("import_peak_memory_long", "ratio", "the same for 512 x 512 x 1500", "import_cost_long", ("<=", 2.5),
           baseline=ITK_CHAIN, full=True),
    Figure("region_growing_cpu", "ms", "CPU time of a region of 5 million voxels in a skull of 512 x 512 x 302",
           "region_growing", baseline="the fastest of ITK, SciPy and scikit-image, as far as they are installed"),
    Figure("region_growing_speedup", "ratio", "the fastest of them over ours; no number unless all voxels are the same",
           "region_growing", (">=", 3.0)),
    # The filters that take noise out of a scan of 512 x 512 x 302 voxels.
    Figure("gaussian_speedup", "ratio", f"Gaussian, sigma of 1 voxel: CPU time of {FILTERS}, over ours, one thread",
           "gaussian", (">=", 4.0), full=True),
    Figure("gaussian_difference", "hu", "largest difference from SciPy's in double precision; rounding to whole HU is "
           "0.5 of it", "gaussian", ("<=", 0.501), full=True),
    Figure("median_speedup", "ratio", f"median of 3 x 3 x 3 voxels: CPU time of {FILTERS}, over ours, one thread",
           "median", (">=", 8.0), full=True),
    Figure("median_differences", "count", "voxels in which it differs from SciPy's", "median", ("==", 0), full=True),
    # What the scan in a case costs.
    *[figure for name, what in (("skull", "a skull of 108 slices"), ("tibia", "two lower legs of 46 slices"))
      for figure in (
        Figure(f"case_schema_{name}_size", "mb", f"{what}: all files of the case", "case_schema",
               baseline="the same bone in schema 1, without its scan"),
        Figure(f"case_schema_{name}_load", "ms", f"{what}: time to load the bone, median", "case_schema",
               baseline="the same bone in schema 1"),
        Figure(f"case_schema_{name}_scan_load", "ms", f"{what}: time to load and verify its scan, median",
               "case_schema", baseline="time to load the bone"))],
    # Bones from real images, burred in frames of 33 cuts.
    *[figure for name, what in (("temporal", "a temporal bone at its own 0.096 mm"),
                                ("skull", "a skull, cuts at a quarter of its pitch")) for figure in (
        Figure(f"real_{name}_frame", "ms", f"{what}: 33 burr cuts and all blocks that they change, median",
               f"real_{name}", baseline="the surface of the whole bone, once", full=True),
        Figure(f"real_{name}_frame_budget", "of_budget", "the same as a part of a 30 Hz frame", f"real_{name}",
               ("<=", 1.0),
               full=True),
        Figure(f"real_{name}_cut_p99", "us", f"{what}: one cut, 99th percentile", f"real_{name}", baseline="median",
               full=True),
        Figure(f"real_{name}_triangle_difference", "count",
               f"{what}: triangles of the whole bone that vtkFlyingEdges3D has more or fewer, with bone above the "
               "isovalue, so that it keeps bone apart on ambiguous faces as we do", f"real_{name}", ("==", 0),
               baseline="with bone below it, where it keeps air apart", full=True),
        Figure(f"real_{name}_memory", "mb", f"{what}: memory of the case", f"real_{name}", full=True),
        Figure(f"real_{name}_memory_cut", "mb", f"{what}: memory of what all these cuts added", f"real_{name}",
               full=True))],
]


def by_name(names, full=False):
    """The figures of these names, or all requested ones. ValueError names the first unknown name."""
    known = {figure.name: figure for figure in FIGURES}
    for name in names:
        if name not in known:
            raise ValueError(f"there is no figure '{name}'; deploy/figures --list shows all")
    return [known[name] for name in names] if names else [figure for figure in FIGURES if full or not figure.full]
