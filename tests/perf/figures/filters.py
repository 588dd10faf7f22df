"""Figures of the filters that take noise out of a scan, compared with the fastest of SciPy, scikit-image and ITK."""
import time

import numpy as np

from registry import Measured

DIMS = (512, 512, 302)  # columns, rows, slices


def scan():
    """A trunk with a bone in it and a scanner's noise, HU."""
    shape = DIMS[::-1]
    z, y, x = np.ogrid[:shape[0], :shape[1], :shape[2]]
    hu = np.full(shape, -1000.0, np.float32)
    hu[np.broadcast_to(((x - 256) / 220) ** 2 + ((y - 256) / 180) ** 2 < 1, shape)] = 40.0
    bone = ((x - 256) / 60) ** 2 + ((y - 256) / 60) ** 2 + ((z - 151) / 140) ** 2
    hu[bone < 1.0] = 1200.0
    hu[bone < 0.6] = 300.0
    hu += np.random.default_rng(1).normal(0.0, 30.0, shape).astype(np.float32)
    return np.rint(hu).clip(-1024, 3071).astype(np.int16)


def timed(function):
    start = time.process_time()
    result = function()
    return time.process_time() - start, result


def python_filters(run, volume):
    """{filter: {library: function}}. scikit-image calls SciPy with other parameters. Its rank.median takes longer."""
    from scipy import ndimage
    found = {
        "gaussian": {"SciPy": lambda: ndimage.gaussian_filter(volume, 1.0, output=np.int16, mode="nearest"),
                     "SciPy, float": lambda: ndimage.gaussian_filter(volume, 1.0, output=np.float32, mode="nearest")},
        "median": {"SciPy": lambda: ndimage.median_filter(volume, 3, mode="nearest")},
    }
    try:
        from skimage import filters
    except ImportError:
        run.say("scikit-image is SKIPPED: the package python3-skimage is not installed")
        return found
    found["gaussian"]["scikit-image"] = lambda: filters.gaussian(
        volume, 1.0, output=np.empty(volume.shape, np.float32), preserve_range=True)
    found["median"]["scikit-image"] = lambda: filters.median(volume, np.ones((3, 3, 3)), mode="nearest")
    return found


ITK_FILTERS = {"gaussian": {"ITK": "gaussian", "ITK, recursive": "recursive_gaussian"}, "median": {"ITK": "median"}}


def compared(run, name, volume, others):
    """All libraries in turns: Measured speedup over the fastest in each turn, and our result."""
    from_file, to_file = run.folder / "scan.raw", run.folder / "filtered.raw"
    volume.tofile(from_file)

    def program(which):
        return float(run.output("osteon-smoothing-bench", which, *DIMS, from_file, to_file))
    seconds, speedups = {}, []
    for turn in range(5 if run.soak else 3):
        run.say(f"{name} of {'x'.join(map(str, DIMS))} voxels, turn {turn + 1}")
        last = {library: program(which) for library, which in ITK_FILTERS[name].items()}
        last |= {library: timed(function)[0] for library, function in others.items()}
        speedups.append(min(last.values()))
        last["ours"] = program(f"ours_{name}")
        speedups[-1] /= last["ours"]
        for library, spent in last.items():
            seconds.setdefault(library, []).append(spent)
    result = np.fromfile(to_file, np.int16).reshape(volume.shape)
    from_file.unlink(), to_file.unlink()
    run.tables.append((f"{name}, CPU seconds, one thread", [("library", "median", "min", "max")] + [
        (library, *(f"{f(spent):.3f}" for f in (np.median, min, max))) for library, spent in seconds.items()]))
    return Measured(float(np.median(speedups)), None, min(speedups), max(speedups), 1), result


def gaussian(run):
    from scipy import ndimage
    volume = scan()
    speedup, ours = compared(run, "gaussian", volume, python_filters(run, volume)["gaussian"])
    exact = ndimage.gaussian_filter(volume, 1.0, output=np.float64, mode="nearest")
    return {"gaussian_speedup": speedup, "gaussian_difference": Measured(float(np.abs(ours - exact).max()))}


def median(run):
    from scipy import ndimage
    volume = scan()
    speedup, ours = compared(run, "median", volume, python_filters(run, volume)["median"])
    exact = ndimage.median_filter(volume, 3, mode="nearest")
    return {"median_speedup": speedup, "median_differences": Measured(int((ours != exact).sum()))}


GROUPS = {"gaussian": gaussian, "median": median}
