"""deploy/figures after building: runs the groups of the requested figures and prints one line for each figure."""
import argparse
import json
import math
import os
import shutil
import signal
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path

import against
import registry
import results as tables_of_results

ROOT = Path(__file__).resolve().parents[3]


def line(figure, value, baseline=None, low=None, high=None, threads=None):
    """NAME VALUE UNIT (baseline VALUE, ratio R[, min A, max B][, threads N]) target T ok|short|info"""
    beside = ""
    if baseline is not None:
        ratio = f"{value / baseline:.3g}" if value is not None and baseline else "-"
        beside = f"baseline {number(baseline)}, ratio {ratio}"
    spread = "" if low is None and high is None else f", min {number(low)}, max {number(high)}"
    parallel = "" if threads is None else f", threads {threads}"
    return (f"{figure.name} {number(value)} {figure.unit} ({beside or 'baseline -, ratio -'}{spread}{parallel}) "
            f"target {figure.target_text()} {figure.verdict(value)}")


def number(value):
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else f"{value:.4g}"


def list_figures(figures, as_json):
    if as_json:
        print(json.dumps([{"name": f.name, "unit": f.unit, "measures": f.measures, "target": f.target_text(),
                           "baseline": f.baseline, "full": f.full} for f in figures], indent=2))
        return
    width = max(len(f.name) for f in figures)
    for f in figures:
        beside = f"; baseline: {f.baseline}" if f.baseline else ""
        print(f"{f.name:{width}}  {f.unit:9}  {f.target_text():8}  "
              f"{f.measures}{beside}{'; only with --full' if f.full else ''}")


def commit():
    def git(*arguments):
        return subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True,
                              check=False).stdout.strip()
    # Results that were just saved are no change of the program.
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!tests/perf/results")
    changed = " with uncommitted changes" if changed else ""
    return (git("rev-parse", "--short=12", "HEAD") or "unknown") + changed


def saved(figure, measured):
    measured = registry.Measured(*measured)
    kept = {"value": rounded(measured.value), "unit": figure.unit, "baseline": rounded(measured.baseline),
            "target": figure.target_text(), "verdict": figure.verdict(measured.value)}
    if measured.low is not None or measured.high is not None:
        kept |= {"min": rounded(measured.low), "max": rounded(measured.high)}
    if measured.threads is not None:
        kept["threads"] = measured.threads
    return kept


def print_tables(tables):
    """Tables beside the figures, for example of all tools. Every column is as wide as needed."""
    for title, rows in tables:
        print(f"# {title}")
        widths = [max(len(str(row[i])) for row in rows) for i in range(len(rows[0]))]
        for row in rows:
            print("#   " + "  ".join(f"{cell!s:{width}}" for cell, width in zip(row, widths)).rstrip())


def results(figures, values, soak, conditions):
    """Numbers with the commit and the conditions. `conditions`: machine, compiler, simd_bits, load_before."""
    return {
        "commit": commit(), "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"),
        "size": "soak" if soak else "quick", "build": "perf", **conditions,
        "figures": {f.name: saved(f, values[f.name]) for f in figures},
    }


def simd_bits(run):
    """Width of the registers that the cut kernel uses on this machine."""
    return 32 * json.loads(run.output("osteon-set-property", 1, 1, 1, 0, 16))["lanes"]


def rounded(value):
    if value is None or isinstance(value, int):
        return value
    return float(f"{value:.5g}") if math.isfinite(value) else None


def skip_reason(figure, skipped):
    """Reason why a figure was left out, if its data is not on this machine. None if it was measured."""
    return next((reason for name, reason in skipped.items() if figure.name.startswith(name)), None)


def measure(figures, run, groups):
    """{figure: (value, baseline)} of the requested figures, group by group."""
    values = {}
    wanted = {f.group for f in figures}
    for name, produce in groups.items():
        if name in wanted:
            values.update(produce(run))
    return values


def stop(*_):
    raise KeyboardInterrupt


def say(text):
    print(f"# {text}", file=sys.stderr, flush=True)


def main():
    parser = argparse.ArgumentParser(prog="deploy/figures", allow_abbrev=False,
                                     description="Measures the numbers that Osteon promises.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="figures to run; all without any")
    parser.add_argument("--list", action="store_true", help="show the figures and what they measure; run nothing")
    parser.add_argument("--json", action="store_true", help="print JSON instead of lines")
    parser.add_argument("--soak", action="store_true", help="longer runs and more repetitions")
    parser.add_argument("--full", action="store_true",
                        help="also the figures that take minutes; each also runs when it is named")
    parser.add_argument("--save", action="store_true",
                        help="also write the results with commit and conditions into tests/perf/results; without "
                             "names, of all figures (--full)")
    parser.add_argument("--against", metavar="COMMIT",
                        help="measure this checkout and COMMIT in alternation; print both medians and their ratio")
    parser.add_argument("--build", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.save and options.against:
        print("deploy/figures: --save and --against do not go together", file=sys.stderr)
        return 2
    try:
        figures = registry.by_name(options.names, options.full or options.list or options.save)
        if options.against:
            against.resolve(options.against)
    except (ValueError, against.Trouble) as error:
        print(f"deploy/figures: {error}", file=sys.stderr)
        return 2
    if options.list:
        list_figures(figures, options.json)
        return 0
    if options.build is None:
        return 0  # the caller only asked if the arguments are valid

    signal.signal(signal.SIGTERM, stop)
    if options.against:
        try:
            return against.run(options.against, figures, options.soak, say)
        except against.Trouble as trouble:
            print(f"deploy/figures: {trouble}", file=sys.stderr)
            return 2
        except KeyboardInterrupt:
            print("deploy/figures: stopped", file=sys.stderr)
            return 130

    import groups  # needs numpy, but --list does not
    if options.save and commit().endswith("changes"):
        print("deploy/figures: --save needs all changes committed, so that its numbers can be traced", file=sys.stderr)
        return 2
    folder = options.build / "figures"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    run = groups.Run(options.build / "bin", folder, options.soak, say)
    load = os.getloadavg()[0]
    try:
        width = simd_bits(run)  # before the long part, because it needs a program that may be missing
        values = measure(figures, run, groups.GROUPS)
    except groups.Failure as failure:
        print(f"deploy/figures: {failure}", *([failure.detail] if failure.detail else []), sep="\n", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("deploy/figures: stopped; every program has been ended", file=sys.stderr)
        return 130
    decided = [f for f in figures if not skip_reason(f, run.skipped)]
    outcome = results(decided, values, options.soak,
                      {"machine": groups.record.machine(), "compiler": tables_of_results.compiler(options.build),
                       "simd_bits": width, "load_before": round(load, 2)})
    if options.save:
        say(f"wrote {tables_of_results.save(outcome, registry.FIGURES).relative_to(ROOT)}")
    if options.json:
        print(json.dumps(outcome, indent=2))
    else:
        for figure in figures:
            reason = skip_reason(figure, run.skipped)
            print(f"{figure.name} skipped: {reason}" if reason else line(figure, *values[figure.name]))
        print_tables(run.tables)
    return 1 if any(f.verdict(values[f.name][0]) == "short" for f in decided) else 0


if __name__ == "__main__":
    sys.exit(main())
