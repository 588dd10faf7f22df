"""Figures of the page of image processing: how soon it shows a slice, and the memory that it takes."""
import json
import shutil

import numpy as np

from imports import use_memory
from registry import Measured

SLICES = 302
TIMES = {"listed_ms": "series listed and chosen", "slice_ms": "first slice drawn", "read_ms": "all slices read",
         "planes_ms": "three planes drawn"}
VOLUME_MB = SLICES * 512 * 512 * 2 / 2**20


def trunk(run):
    """The phantom of a trunk as a folder of DICOM slices."""
    folder = run.folder / "imaging-trunk"
    if not folder.exists():
        run.say(f"a phantom of {SLICES} slices of 512 x 512")
        run.output("osteon-import-cost", "phantom", SLICES, folder)
    return folder


def first_slice(run):
    """In turns with GDCM. Each side has read the folder once before, so that both find it in memory."""
    folder = trunk(run)
    run.say("the first slice on the page, and GDCM")
    page, gdcm = [], []
    for turn in range(10 if run.soak else 6):
        use_memory(5 * VOLUME_MB)
        gdcm.append(json.loads(run.output("osteon-imaging-page", "decode", folder)))
        use_memory(5 * VOLUME_MB)
        page.append(json.loads(run.output("osteon-imaging-page", "slice", folder)))
    page, gdcm = page[1:], gdcm[1:]
    theirs = [g["headers_ms"] + g["decode_ms"] for g in gdcm]
    ours, planes = [p["slice_ms"] for p in page], [p["planes_ms"] for p in page]
    ratios = [a / b for a, b in zip(ours, theirs)]  # of neighbours in time
    middle = {what: float(np.median([p[what] for p in page])) for what in TIMES}
    run.tables.append((
        f"the first of {gdcm[0]['slices']} slices on the page, {page[0]['volume_mb']:.0f} MB",
        [("ms since the folder was chosen", "median")] +
        [(what, f"{middle[key]:.0f}") for key, what in TIMES.items()] +
        [(f"GDCM: {what}", f"{float(np.median([g[key] for g in gdcm])):.0f}")
         for what, key in (("headers", "headers_ms"), ("slices", "decode_ms"))]))
    return {
        "imaging_first_slice": Measured(float(np.median(ratios)), None, min(ratios), max(ratios)),
        "imaging_first_slice_time": Measured(1e-3 * float(np.median(ours)), 1e-3 * float(np.median(theirs)),
                                             1e-3 * min(ours), 1e-3 * max(ours)),
        "imaging_three_planes_time": Measured(1e-3 * middle["planes_ms"], 1e-3 * float(np.median(theirs)),
                                              1e-3 * min(planes), 1e-3 * max(planes)),
    }


def memory(run):
    folder = trunk(run)
    run.say("memory of the page while a person segments")
    out = json.loads(run.output("osteon-imaging-page", "segment", folder))
    volume_mb = out["volume_mb"]
    rows = [("peak over the scan's voxels", "the page", "with osteon-import")]
    rows += [(step["what"], f"{step['page_mb'] / volume_mb:.2f}", f"{step['together_mb'] / volume_mb:.2f}")
             for step in out["steps"]]
    run.tables.append((f"memory on the page, a scan of {volume_mb:.0f} MB", rows))
    page_mb, before_mb = max(step["page_mb"] for step in out["steps"]), out["before_mb"]
    together_mb = max(step["together_mb"] for step in out["steps"])
    return {
        "imaging_memory": Measured((page_mb - before_mb) / volume_mb),
        "imaging_memory_whole": Measured(page_mb / volume_mb, before_mb / volume_mb),
        "imaging_memory_with_importer": Measured(together_mb / volume_mb, before_mb / volume_mb),
    }


def imaging_page(run):
    values = first_slice(run) | memory(run)
    shutil.rmtree(trunk(run))
    return values


GROUPS = {"imaging_page": imaging_page}
