"""Shows that the tests notice faults: puts one fault at a time into a copy of the sources, and runs a test on it.

  python3 -B tests/mutations/run.py              all mutations; takes long, because each one is built
  python3 -B tests/mutations/run.py --only 3     one of them, by its number; may be given several times
  python3 -B tests/mutations/run.py --list       prints them
  python3 -B tests/mutations/run.py --check      whether each can still be made; builds nothing

Exit code: 0 if every mutation is caught, 1 if one is not, 2 for a wrong call, 130 after Ctrl-C or SIGTERM.
"""
import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

ROOT = Path(__file__).resolve().parents[2]
CAUGHT, SURVIVED, BROKEN, WRONG, EQUIVALENT = "caught", "survived", "did not compile", "no valid test", "equivalent"
GOOD = (CAUGHT, EQUIVALENT)


@dataclass(frozen=True)
class Mutation:
    file: str         # from the root of the project
    text: str         # occurs exactly once in the file
    replacement: str
    breaks: str       # what is wrong then
    target: str       # program of tests that notices it
    filter: str       # of GoogleTest
    equivalent: str = ""  # why no test can notice it; empty: a test must


def faults(mutations, root):
    """What is wrong with the list: each line must still be there, once."""
    found = []
    for number, m in enumerate(mutations, 1):
        path = root / m.file
        if not path.is_file():
            found.append(f"{number}: there is no {m.file}")
            continue
        count = path.read_text(encoding="utf-8").count(m.text)
        if count != 1:
            found.append(f"{number}: {m.file} has the text {count} times instead of once: {m.text.strip()}")
        if m.text == m.replacement:
            found.append(f"{number}: the replacement changes nothing")
        if not (m.breaks and m.target and m.filter):
            found.append(f"{number}: a field is empty")
    seen = set()
    for number, m in enumerate(mutations, 1):
        if (m.file, m.text, m.replacement) in seen:
            found.append(f"{number}: it is in the list twice")
        seen.add((m.file, m.text, m.replacement))
    return found


class Mutated:
    """One fault in a file, for the time of a with statement. Whatever ends it, the file is restored."""

    def __init__(self, mutation, tree):
        self.path, self.mutation = tree / mutation.file, mutation

    def __enter__(self):
        self.before = self.path.read_text(encoding="utf-8")
        if self.before.count(self.mutation.text) != 1:
            raise ValueError(f"{self.mutation.file} has the text not exactly once")
        self.path.write_text(self.before.replace(self.mutation.text, self.mutation.replacement), encoding="utf-8")

    def __exit__(self, *_):
        self.path.write_text(self.before, encoding="utf-8")


def end(process):
    """Ends the process and its group. Ninja's compilers have groups of their own: ninja itself must end them."""
    os.killpg(process.pid, signal.SIGTERM)
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def stop_on_sigterm():
    """SIGTERM does what Ctrl-C does. A process that a shell started in the background ignores SIGINT."""
    def stop(_number, _frame):
        raise KeyboardInterrupt
    signal.signal(signal.SIGTERM, stop)


@contextmanager
def signals_held():
    """Delays SIGINT and SIGTERM, so that they cannot come between the start of a process and its name."""
    came = []
    handlers = {number: signal.signal(number, lambda number, _: came.append(number))
                for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in came:
            signal.raise_signal(number)


class Copy:
    """A copy of the sources with a build of its own. Files that did not change keep their times, so little is built."""

    def __init__(self, root, tree, jobs, seconds):
        self.root, self.tree, self.jobs, self.seconds = root, tree, jobs, seconds
        self.log = tree.parent / "build.log"

    def update(self):
        listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=self.root,
                                check=True, capture_output=True).stdout.decode().split("\0")
        names = {name for name in listed if name and (self.root / name).is_file()}
        for name in sorted(names):
            source, to = self.root / name, self.tree / name
            if to.is_file() and to.read_bytes() == source.read_bytes():
                continue
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, to)
            shutil.copymode(source, to)
        for path in [p for p in self.tree.rglob("*") if p.is_file()]:
            name = path.relative_to(self.tree)
            if name.parts[0] != "build" and name.as_posix() not in names:
                path.unlink()

    def run(self, command, cwd, seconds=None):
        """The exit code, and None after a timeout. Ends the command with all that it started."""
        process = None
        try:
            with open(self.log, "ab") as log, signals_held():
                process = subprocess.Popen(command, cwd=cwd, stdout=log, stderr=log, stdin=subprocess.DEVNULL,
                                           start_new_session=True)
            return process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None
        finally:
            if process and process.poll() is None:
                end(process)

    def build(self, target):
        build = self.tree / "build/dev"
        if not (build / "build.ninja").exists() and self.run(["cmake", "--preset", "dev"], self.tree) != 0:
            return False
        return self.run(["cmake", "--build", str(build), "-j", str(self.jobs), "--target", target], self.tree) == 0

    def failure(self, target, test_filter):
        """The first test that fails, or how the program ended without one. Empty: all tests pass."""
        program, begin = self.tree / "build/dev/bin" / target, self.log.stat().st_size
        code = self.run([str(program), f"--gtest_filter={test_filter}"], self.tree / "build/dev", self.seconds)
        if code == 0:
            return ""
        failed = re.search(rb"^\[  FAILED  \] ([^\s,]+)", self.log.read_bytes()[begin:], re.MULTILINE)
        if failed:
            return failed[1].decode()
        return f"no end within {self.seconds:.0f} s" if code is None else f"exit code {code}"

    def has_tests(self, target, test_filter):
        program = self.tree / "build/dev/bin" / target
        listed = subprocess.run([str(program), "--gtest_list_tests", f"--gtest_filter={test_filter}"], check=False,
                                capture_output=True, text=True)
        return any(line.startswith("  ") for line in listed.stdout.splitlines())


def judge(mutation, copy, sound):
    """Verdict on one mutation, and what noticed it. `sound`: what is known of tests on the sources as they are."""
    key = (mutation.target, mutation.filter)
    if key not in sound:
        # A test that fails anyway, or that is not there, would prove nothing.
        sound[key] = copy.build(mutation.target) and copy.has_tests(*key) and not copy.failure(*key)
    if not sound[key]:
        return WRONG, ""
    with Mutated(mutation, copy.tree):
        if not copy.build(mutation.target):
            return BROKEN, ""
        if by := copy.failure(*key):
            return CAUGHT, by
    return (EQUIVALENT if mutation.equivalent else SURVIVED), ""


def judge_all(chosen, copy, say):
    """Verdicts and what noticed, by number. After Ctrl-C, those so far."""
    verdicts, by, sound, complete = {}, {}, {}, False
    try:
        for place, (number, mutation) in enumerate(chosen, 1):
            begun = time.monotonic()
            say(f"[{place}/{len(chosen)}] {number}: {mutation.file}: {mutation.breaks}")
            verdicts[number], by[number] = judge(mutation, copy, sound)
            noticed = f" by {by[number]}" if by[number] else ""
            say(f"[{place}/{len(chosen)}] {number}: {verdicts[number]}{noticed} after {time.monotonic() - begun:.0f} s")
        complete = True
    except KeyboardInterrupt:
        say("stopped; the sources are as before")
    return verdicts, by, complete


def table(chosen, verdicts, by):
    rows = [(str(n), verdicts.get(n, "not run"), m.file, m.breaks, by.get(n, "")) for n, m in chosen]
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    lines = ["  ".join(row[i].ljust(widths[i]) for i in range(5)).rstrip() for row in rows]
    counts = {v: list(verdicts.values()).count(v) for v in dict.fromkeys(verdicts.values())}
    return "\n".join([*lines, ", ".join(f"{count} {verdict}" for verdict, count in counts.items())])


def arguments(given):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", type=int, action="append", metavar="N", help="the mutation of this number")
    parser.add_argument("--list", action="store_true", help="print the mutations")
    parser.add_argument("--check", action="store_true", help="check that each can be made; build nothing")
    parser.add_argument("--scratch", type=Path, default=ROOT / "build/mutations", help="folder of the copy")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="jobs of a build")
    parser.add_argument("--seconds", type=float, default=600.0, help="a test that takes longer has noticed the fault")
    return parser.parse_args(given)


def main(mutations, given=None, root=ROOT, make_copy=Copy):
    options = arguments(given)
    wrong = [n for n in options.only or [] if not 1 <= n <= len(mutations)]
    if wrong:
        print(f"--only {wrong[0]}: the mutations have the numbers 1 to {len(mutations)}", file=sys.stderr)
        return 2
    chosen = [(n, m) for n, m in enumerate(mutations, 1) if not options.only or n in options.only]
    if options.list:
        for n, m in chosen:
            print(f"{n:3}  {m.file}: {m.breaks} [{m.target} {m.filter}]")
        return 0
    found = faults(mutations, root)
    if found or options.check:
        print("\n".join(found) if found else f"each of {len(mutations)} mutations can be made")
        return 1 if found else 0
    tree = options.scratch / "tree"
    tree.mkdir(parents=True, exist_ok=True)
    copy = make_copy(root, tree, options.jobs, options.seconds)
    try:
        copy.update()
    except KeyboardInterrupt:
        print("stopped while copying")
        return 130
    verdicts, by, complete = judge_all(chosen, copy, lambda line: print(line, flush=True))
    print(table(chosen, verdicts, by))
    if not complete:
        return 130
    return 0 if all(v in GOOD for v in verdicts.values()) else 1


if __name__ == "__main__":
    from mutations import MUTATIONS
    stop_on_sigterm()
    sys.exit(main(MUTATIONS))
