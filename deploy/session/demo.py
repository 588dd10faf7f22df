"""The part of deploy/demo after installation and build: makes the case, runs a session, writes its report."""
import argparse
import fcntl
import hashlib
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import plans
import plots
import record
import report
import screen
import together
from processes import Failure
from session import ROOT, Session, case_info, save

MARK = ".osteon-session"  # a file that only folders of demos have
EXAMPLE = "usr/share/doc/invesalius-examples/examples/Cranium.inv3"

# A desktop device that can hold 3.3 N. The rendered force is what such a device would show.
DEVICE = "simulated-3.3N"
FIRST_TOOL = "drill-3.2"

def say(line):
    print(line, flush=True)


def example_skull():
    for root in (Path("/"), ROOT / "build" / "examples"):
        if (root / EXAMPLE).exists():
            return root / EXAMPLE
    raise Failure(f"the example CT (/{EXAMPLE}) is not there; deploy/install fetches it")


def fingerprint(source: Path, importer: Path):
    """A name for an import: the same files and the same importer give the same name."""
    files = sorted(source.rglob("*")) if source.is_dir() else [source]
    digest = hashlib.sha256()
    for file in [importer, *files]:
        status = file.stat() if file.exists() else file.lstat()  # a link may lead nowhere
        name = "" if file == importer else str(file.relative_to(source))
        digest.update(f"{name}\0{status.st_size}\0{status.st_mtime_ns}\n".encode())
    return digest.hexdigest()[:16]


@contextmanager
def own_folder(out: Path):
    """Keeps other demos out of the folder. None of them changes a file of one that still runs."""
    out.mkdir(parents=True, exist_ok=True)
    with open(out / MARK, "a", encoding="utf-8") as mark:
        try:
            fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise Failure(f"another demo writes into {out}; wait until it has ended, "
                          "or name another folder with --out") from None
        yield


def empty(out: Path):
    """Removes what an earlier demo left."""
    for entry in out.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        elif entry.name != MARK:
            entry.unlink()


def prepare_case(source: Path, programs: Path, title):
    """The case to work on. A case is used as it is. Anything else is imported once and then reused."""
    if (source / "case.json").exists():
        return source
    importer = programs / "osteon-import"
    name = "".join(c if c.isalnum() else "-" for c in source.stem) or "case"
    return made_once(f"{name}-{fingerprint(source, importer)}", source, [importer, "ct", source, *title])


def phantom_case(bone, programs: Path):
    importer = programs / "osteon-import"
    return made_once(f"{bone}-{fingerprint(importer, importer)}", f"the phantom of a {bone}",
                     [importer, "phantom", bone])


def made_once(name, what, command):
    """The case of that name in build/cases. `command` makes it, if it is not there."""
    case = ROOT / "build" / "cases" / name
    if (case / "case.json").exists():
        return case
    case.parent.mkdir(parents=True, exist_ok=True)
    # Another demo may be making the same case. Then this one waits and takes it.
    with open(case.with_name(f"{case.name}.lock"), "a", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (case / "case.json").exists():
            make_case(what, command, case)
    return case


def make_case(what, command, case: Path):
    say(f"Importing {what}")
    started = time.monotonic()
    # In its own process session, so that Ctrl-C reaches it only once, through this process.
    process = subprocess.Popen([*command, "--out", case], stdin=subprocess.DEVNULL, text=True,
                               stderr=None if sys.stderr.isatty() else subprocess.PIPE, start_new_session=True)
    try:
        _, errors = process.communicate()
    except KeyboardInterrupt:
        process.send_signal(signal.SIGINT)
        process.wait()
        raise
    if process.returncode != 0:
        words = (errors or "").strip().splitlines()
        raise Failure(words[-1] if words else f"osteon-import could not read {what}")
    say(f"Imported in {time.monotonic() - started:.0f} s; the next run finds the case in build/cases.")


def run_on_some_side(programs, case, entries, out, window):
    """Runs the session. If there is no bone at one entry, the next one is tried."""
    for entry in entries:
        try:
            return Session(programs, case, plans.drill_and_window(entry), out, say, device=DEVICE,
                           window=window).run()
        except Failure as failure:
            if entry == entries[-1] or "entry" not in failure.detail:
                raise
            say(f"No bone to drill along {plans.outward(entry).tolist()}; trying from another side.")
    return None


def case_title(programs, case):
    return case_info(programs, case).get("title") or case.name


def chosen_case(options, programs):
    if options.bone:
        return phantom_case(options.bone, programs)
    if options.case:
        return prepare_case(options.case.resolve(), programs, [])
    return prepare_case(example_skull().resolve(), programs, ["--title", "Human skull"])


def try_it(options, programs):
    """The window `osteon` with the drill in the hand, until the user closes it. It ends the programs that it starts."""
    case = chosen_case(options, programs)
    if not screen.display_opens():
        raise Failure("--try: the screen does not open any more")
    say("Move the mouse over the bone: the drill rests where the pointer is.\n"
        "Hold the left button to drill. The wheel sets how hard you push; the right button turns the drill.\n"
        "Close the window, or press Ctrl-C here, to end. The window's start page offers what you cut again.")
    # In its own process session, so that Ctrl-C reaches it only once, through this process.
    window = subprocess.Popen(["setpriv", "--pdeathsig", "TERM", programs / "osteon", case, "--tool", FIRST_TOOL],
                              stdin=subprocess.DEVNULL, start_new_session=True)
    try:
        code = window.wait()
    except KeyboardInterrupt:
        window.terminate()
        window.wait()
        raise
    if code != 0:
        raise Failure(f"the window ended with {code}" if code > 0 else
                      f"the window was ended by {signal.Signals(-code).name}")
    return 0


def run(options, programs, out):
    """The demo, in a folder of its own. Exit code 1: somebody held another bone at the end."""
    started = time.monotonic()
    case = chosen_case(options, programs)
    if options.bone:
        together_at = plans.on_phantom(case_info(programs, case), options.bone)
        alone_at = together_at[:1]
    elif options.case:
        together_at = plans.from_two_sides(*plans.ANY_SIDE[1:3])
        alone_at = [plans.toward(side) for side in plans.ANY_SIDE]
    else:
        together_at = plans.from_two_sides(plans.LEFT_PARIETAL, plans.RIGHT_PARIETAL)
        alone_at = together_at[:1]
    empty(out)
    if options.together:
        return together.run(programs, case, together_at, out, say, DEVICE, case_title(programs, case),
                            options.window)
    numbers = run_on_some_side(programs, case, alone_at, out, options.window)
    say("Writing the report")
    session = record.read_table(out / "session.csv")
    plots.force_and_depth(session, out / "force_depth.png")
    numbers["sound"] = plots.spectrogram(out / "sound.wav", out / "spectrogram.png")
    save(numbers, out)
    report.write(out, numbers, numbers["case"].get("title") or case.name)
    summarise(numbers, out, time.monotonic() - started)
    return 0 if same_bone(numbers) else 1


def end_politely(*_):
    raise KeyboardInterrupt


def main():
    parser = argparse.ArgumentParser(prog="deploy/demo")
    parser.add_argument("--case", type=Path)
    parser.add_argument("--bone")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--together", action="store_true")
    parser.add_argument("--window", action="store_true", help="the window osteon shows the work")
    parser.add_argument("--try", action="store_true", dest="by_hand", help="the window osteon for the user's own hand")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, end_politely)
    programs = options.build / "bin"
    out = options.out.resolve() if options.out else None
    try:
        if options.by_hand:
            return try_it(options, programs)
        with own_folder(out):
            return run(options, programs, out)
    except Failure as failure:
        print(f"deploy/demo: {failure}", *([failure.detail] if failure.detail else []), sep="\n", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"deploy/demo: {error.filename or out}: {error.strerror}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("deploy/demo: stopped; every program has been ended", file=sys.stderr)
        return 130


def same_bone(numbers):
    journal, held = numbers["journal"], numbers["agreement"]
    kept = journal["sound"] and journal["field_hash"] == held["field_hash_server"]
    return kept and held["field_hash_equal"] and held["mesh_differences"] == 0


def summarise(numbers, out, seconds):
    latency = numbers["latency_ms"]
    for step in report.cutting_steps(numbers):
        say(f"{step['tool']}: {step['deepest_mm']:.1f} mm deep, {step['while_cutting']['force_n']:.1f} N on average, "
            f"{step['peak_force_n']:.1f} N at most, {step['removed_mm3']:.0f} mm³ removed (simulated device)")
    for key, (name, _) in report.LATENCIES.items():
        if latency.get(key, {}).get("count"):
            say(f"{name}: median {latency[key]['p50']:.1f} ms, 99 % {latency[key]['p99']:.1f} ms")
    say("Server, haptic client and viewer hold " + ("the same bone" if same_bone(numbers) else "DIFFERENT bones") +
        " at the end.")
    journal = numbers["journal"]
    say(f"The room's journal, {journal['events']} events in {journal['bytes'] / 1e6:.1f} MB, makes " +
        ("the same bone" if journal["field_hash"] == numbers["agreement"]["field_hash_server"] else "ANOTHER bone")
        + " again.")
    say(f"Session of {seconds:.0f} s. Report: {out / 'report.html'}")


if __name__ == "__main__":
    sys.exit(main())
