"""Runs the programs of a session as child processes: starts and watches them, ends them by id, keeps their logs."""
import collections
import os
import queue
import signal
import subprocess
import threading
import time
from pathlib import Path


class Failure(Exception):
    """The error that ends a session early, as one sentence. `detail` may hold the last lines of a log."""

    def __init__(self, sentence, detail=""):
        super().__init__(sentence)
        self.detail = detail


class Child:
    """One program. Its standard error goes to a log file. Its standard output is read line by line."""

    def __init__(self, name, command, logs: Path, environment, takes_input=False):
        self.name = name
        self.may_end = False  # true when its end is expected
        self.log = logs / f"{name}.log"
        self._lines = queue.Queue()
        self._recent = collections.deque(maxlen=20)
        with open(self.log, "wb") as log:
            # If this process is killed, the kernel ends the child. A terminal's Ctrl-C reaches only this process, which
            # then ends the children in order.
            self._process = subprocess.Popen(
                ["setpriv", "--pdeathsig", "TERM", *map(str, command)],
                stdin=subprocess.PIPE if takes_input else subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=log, env=environment, start_new_session=True,
                text=True, encoding="utf-8", errors="replace")
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            self._recent.append(line.rstrip("\n"))
            self._lines.put(line.rstrip("\n"))

    @property
    def pid(self):
        return self._process.pid

    @property
    def exit_code(self):
        """None while it runs. Minus the signal's number if a signal ended it."""
        return self._process.poll()

    def new_lines(self):
        """Its output since the last call."""
        lines = []
        while not self._lines.empty():
            lines.append(self._lines.get())
        return lines

    def next_line(self, patience_s):
        """The next printed line. None if it ended first, or if nothing came in this time."""
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            try:
                return self._lines.get(timeout=0.1)
            except queue.Empty:
                if self.exit_code is not None and not self._reader.is_alive() and self._lines.empty():
                    return None
        return None

    def say(self, line):
        try:
            self._process.stdin.write(line + "\n")
            self._process.stdin.flush()
        except (OSError, ValueError):
            pass  # it has ended; the wait for the answer reports this

    def last_words(self, count=6):
        """The end of its log, or of its output if the log is empty."""
        text = self.log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return "\n".join(f"  {line}" for line in (text or list(self._recent))[-count:])

    def wait(self, patience_s):
        try:
            return self._process.wait(timeout=patience_s)
        except subprocess.TimeoutExpired:
            return None

    def end(self, patience_s=10.0):
        """Sends SIGTERM, and SIGKILL if that does not end it. Returns the exit code."""
        if self.exit_code is None:
            self._process.send_signal(signal.SIGTERM)
            if self.wait(patience_s) is None:
                self._process.kill()
                self._process.wait()
        self._reader.join(timeout=1.0)
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None and not self._reader.is_alive():
                pipe.close()
        return self.exit_code


class Household:
    """All children of a session. The end of the block ends those that still run, the newest first."""

    def __init__(self, logs: Path):
        self.logs = logs
        self.children = []
        logs.mkdir(parents=True, exist_ok=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for child in reversed(self.children):
            child.end(patience_s=5.0)

    def start(self, name, command, environment=None, takes_input=False):
        child = Child(name, command, self.logs, environment or dict(os.environ), takes_input)
        self.children.append(child)
        return child

    def check(self):
        """Raises Failure if a child has ended without a request."""
        for child in self.children:
            if child.exit_code is not None and not child.may_end:
                raise self.died(child)

    def died(self, child):
        how = f"ended with {child.exit_code}" if child.exit_code is None or child.exit_code >= 0 else \
            f"was ended by {signal.Signals(-child.exit_code).name}"
        return Failure(f"{child.name} {how}; its last lines (all of them in {child.log}):", child.last_words())

    def wait_for_file(self, file: Path, what, patience_s=30.0):
        deadline = time.monotonic() + patience_s
        while not (file.exists() and file.read_text().endswith("\n")):
            self.check()
            if time.monotonic() > deadline:
                raise Failure(f"{what} was not ready within {patience_s:.0f} s")
            time.sleep(0.02)
        return file.read_text().strip()


def has_sound_server():
    """Whether sound can be played here: a PulseAudio server answers, or starts on request."""
    try:
        return subprocess.run(["pactl", "info"], stdin=subprocess.DEVNULL, capture_output=True, timeout=5,
                              check=False).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False
