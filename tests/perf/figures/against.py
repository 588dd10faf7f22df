"""deploy/figures --against COMMIT: this checkout and another commit, measured in alternation on the same machine.

Each side runs its own deploy/figures, which builds it first. So each side is measured by its own programs, and figures
that only one side has are left out."""
import json
import statistics
import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
TREE = ROOT / "build" / "against"  # the other commit's worktree; the next comparison uses it and its builds again
ROUNDS, SOAK_ROUNDS = 3, 7


class Trouble(Exception):
    """One sentence for the user."""


@dataclass
class Comparison:
    """One figure: its values on both sides, round by round."""
    name: str
    unit: str
    here: list
    there: list

    def line(self, commit):
        """NAME MEDIAN UNIT (min A, max B) COMMIT MEDIAN (min A, max B) ratio R (min A, max B)"""
        ratios = [a / b if b else None for a, b in zip(self.here, self.there)]
        sides = [side(self.here), side(self.there), side([r for r in ratios if r is not None])]
        return f"{self.name} {self.unit}: here {sides[0]}; {commit} {sides[1]}; ratio {sides[2]}"


def side(values):
    if not values:
        return "-"
    return f"{statistics.median(values):.4g} (min {min(values):.4g}, max {max(values):.4g})"


def git(*arguments, root=ROOT):
    return subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, check=False)


def resolve(commit, root=ROOT):
    """The full name of a commit. Trouble if there is none."""
    found = git("rev-parse", "--verify", "--quiet", "--end-of-options", f"{commit}^{{commit}}", root=root)
    if found.returncode != 0:
        raise Trouble(f"there is no commit '{commit}' in this checkout")
    return found.stdout.strip()


def prepare(commit, root=ROOT, tree=TREE):
    """Puts the commit into the worktree. Trouble if git cannot."""
    git("worktree", "prune", root=root)
    if (tree / ".git").exists():
        done = git("checkout", "--quiet", "--force", "--detach", commit, root=tree)
    else:
        done = git("worktree", "add", "--quiet", "--force", "--detach", str(tree), commit, root=root)
    if done.returncode != 0:
        raise Trouble(f"git cannot put {commit[:12]} into {tree.relative_to(root)}: {done.stderr.strip()}")
    if not (tree / "deploy" / "figures").exists():
        raise Trouble(f"{commit[:12]} has no deploy/figures")
    return tree


class Runner:
    """Runs deploy/figures of a checkout."""

    def __init__(self, soak, say):
        self.options, self.say = (["--soak"] if soak else []), say

    def names(self, tree):
        """Names of all figures that a checkout has."""
        return [f["name"] for f in json.loads(self._output(tree, "--list", "--json"))]

    def measure(self, tree, names):
        """{name: (value, unit)} of one run."""
        figures = json.loads(self._output(tree, "--json", *self.options, *names))["figures"]
        return {name: (f["value"], f["unit"]) for name, f in figures.items()}

    def _output(self, tree, *arguments):
        program = subprocess.Popen([tree / "deploy" / "figures", *arguments], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        try:
            out, errors = program.communicate()
        except BaseException:
            program.terminate()  # it ends its own programs
            program.wait()
            raise
        if program.returncode not in (0, 1) or not out.strip():  # 1: a figure is short
            last = (errors.strip().splitlines() or ["it says nothing"])[-1]
            where = "this checkout" if tree == ROOT else "the other commit"
            raise Trouble(f"deploy/figures of {where} ended with {program.returncode}: {last}")
        return out


def compare(runner, names, here, there, rounds):
    """Comparisons of the figures that both sides have. The side that begins changes every round.
    Trouble if they have none in common."""
    known = set(runner.names(there))
    common, missing = [n for n in names if n in known], [n for n in names if n not in known]
    if not common:
        raise Trouble("the other commit has none of these figures")
    found = {name: Comparison(name, "", [], []) for name in common}
    for number in range(rounds):
        runner.say(f"round {number + 1} of {rounds}")
        values = {tree: runner.measure(tree, common) for tree in ((here, there) if number % 2 == 0 else (there, here))}
        for name, comparison in found.items():
            ours, theirs = values[here].get(name), values[there].get(name)
            if ours and theirs and ours[0] is not None and theirs[0] is not None:
                comparison.unit = ours[1]
                comparison.here.append(ours[0])
                comparison.there.append(theirs[0])
    return [c for c in found.values() if c.here], missing


def run(commit, figures, soak, say):
    """Prints one line for each figure. Trouble says in one sentence what went wrong."""
    full = resolve(commit)
    tree = prepare(full)
    comparisons, missing = compare(Runner(soak, say), [f.name for f in figures], ROOT, tree,
                                   SOAK_ROUNDS if soak else ROUNDS)
    for comparison in comparisons:
        print(comparison.line(full[:12]))
    measured = {c.name for c in comparisons}
    for figure in figures:
        if figure.name not in measured:
            print(f"{figure.name} skipped: " + ("the other commit does not have it" if figure.name in missing
                                                else "not measured on both sides"))
    return 0
