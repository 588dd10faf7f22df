"""tests/perf/results: the figures that were measured last, as tables. One file for each kind of processor.

A file has one section for each run of deploy/figures --save, the newest first, with its commit and conditions. A figure
that is measured again moves to the newest section, so every figure is in one section only."""
import math
import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
HEAD = ("figure", "value", "unit", "baseline", "min", "max", "threads", "target", "verdict")
RUN = re.compile(r"## (\S+), (\d{4}-\d\d-\d\d)$")
ROW = re.compile(r"\| (\w+) \|")


@dataclass
class Section:
    """One run: its commit and date, a paragraph of its conditions, and rows by the figure's name."""
    commit: str
    date: str
    conditions: str
    rows: dict = field(default_factory=dict)


def results_file(machine):
    """One file for each kind of machine, named by processor and cores, without host names."""
    words = re.sub(r"[^a-z0-9]+", "-", f"{machine['processor']} {machine['cores']} cores".lower()).strip("-")
    return ROOT / "tests" / "perf" / "results" / f"{words}.md"


def compiler(build):
    """Name and version of the compiler that made a build folder."""
    cache = (build / "CMakeCache.txt").read_text(encoding="utf-8")
    found = re.search(r"^CMAKE_CXX_COMPILER:\w+=(.+)$", cache, re.MULTILINE)
    said = subprocess.run([found[1], "--version"], capture_output=True, text=True, check=False).stdout if found else ""
    return said.splitlines()[0] if said else "unknown"


def conditions(outcome):
    """What a run depends on. `outcome`: as of figures.results()."""
    machine = outcome["machine"]
    return (f"Build {outcome['build']}, {outcome['size']} runs. Compiler: {outcome['compiler']}. SIMD: "
            f"{outcome['simd_bits']} bits.\nLoad before: {outcome['load_before']:g} (processes that waited for a "
            f"processor). Linux {machine['kernel']}.")


def cell(value):
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "-"
    return str(value) if isinstance(value, int) else f"{value:.4g}"


def row(name, kept):
    """A figure's line. `kept`: as of figures.saved()."""
    return "| " + " | ".join((name, cell(kept["value"]), kept["unit"], cell(kept["baseline"]), cell(kept.get("min")),
                              cell(kept.get("max")), cell(kept.get("threads")), kept["target"],
                              kept["verdict"])) + " |"


def section(outcome):
    return Section(outcome["commit"], outcome["date"], conditions(outcome),
                   {name: row(name, kept) for name, kept in outcome["figures"].items()})


def read(text):
    """The sections of a file."""
    sections = []
    for line in text.splitlines():
        if begins := RUN.match(line):
            sections.append(Section(begins[1], begins[2], ""))
        elif sections and (found := ROW.match(line)) and found[1] != HEAD[0]:
            sections[-1].rows[found[1]] = line
        elif sections and line and not line.startswith(("#", "|")):
            sections[-1].conditions += ("\n" if sections[-1].conditions else "") + line
    return sections


def merged(old, new, known):
    """`new` before the `old` sections. These lose what was measured again, and figures that are not `known` now."""
    kept = [Section(s.commit, s.date, s.conditions, {name: line for name, line in s.rows.items()
                                                     if name in known and name not in new.rows}) for s in old]
    return [new] + [s for s in kept if s.rows]


def write(sections, machine, groups):
    """The file's text. `groups`: {figure: its group}, in the order of the tables."""
    lines = [f"# Figures on {machine['processor']}, {machine['cores']} cores", "",
             "`deploy/figures --save` writes this page. `deploy/figures --list` says what each figure measures.",
             "Every figure stands under the commit at which it was last measured.", ""]
    for s in sections:
        lines += [f"## {s.commit}, {s.date}", "", *s.conditions.splitlines(), ""]
        for group in dict.fromkeys(groups.values()):
            rows = [s.rows[name] for name in groups if groups[name] == group and name in s.rows]
            if rows:
                lines += [f"### {group.replace('_', ' ')}", "", "| " + " | ".join(HEAD) + " |",
                          "|---" * len(HEAD) + "|", *rows, ""]
    return "\n".join(lines).rstrip("\n") + "\n"


def save(outcome, figures):
    """Writes an outcome into the file of its machine. `figures`: all of the registry."""
    file, groups = results_file(outcome["machine"]), {f.name: f.group for f in figures}
    old = read(file.read_text(encoding="utf-8")) if file.exists() else []
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(write(merged(old, section(outcome), groups), outcome["machine"], groups), encoding="utf-8")
    return file
