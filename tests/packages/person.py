"""A person at the window `osteon` on a virtual screen: what they wait for, see, click and type."""
import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import desk
from processes import Failure, Household

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ("osteon", "osteon-import", "osteon-server", "osteon-haptic", "osteon-audio")


def ended(*command):
    """A program that ended by itself and well."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=600, check=False)
    if done.returncode != 0:
        raise Failure(f"{Path(str(command[0])).name} {command[1]} failed:", done.stderr.strip())
    return done


def run(*command):
    """Both outputs of a program that ends by itself."""
    done = ended(*command)
    return done.stdout + done.stderr


def said(*command):
    """Its standard output alone."""
    return ended(*command).stdout


def programs_in(folder):
    """Name -> path. Failure: one is missing."""
    found = {name: shutil.which(name, path=folder) for name in PROGRAMS}
    for name, path in found.items():
        if path is None:
            raise Failure(f"there is no {name} in {folder or 'PATH'}; install the packages, or give --bin FOLDER")
    return {name: Path(path).resolve() for name, path in found.items()}


@contextlib.contextmanager
def at_a_desk(logs, width, height):
    """(household, screen, folder): a virtual screen of this size, and a folder for all that is written. Both go, and so
    does every process, by its id."""
    desk.own_orphans()
    # A short path, because that of a socket has at most 107 characters.
    with tempfile.TemporaryDirectory(prefix="osteon-person.") as temporary:
        folder = Path(temporary)
        os.chdir(folder)  # where dialogs of files begin
        try:
            with Household(logs) as household:
                yield household, desk.Screen(household, folder, width, height), folder
        finally:
            desk.end_orphans()


def ends(main, name):
    """Runs the program to its end. A failure is one sentence, and exit code 1."""
    try:
        main()
    except Failure as failure:
        print(f"{name}: {failure}", file=sys.stderr)
        if failure.detail:
            print(failure.detail, file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)


class Words:
    """What the window says in a language."""

    def __init__(self, language):
        self._german = {}
        if language == "de":
            tree = ElementTree.parse(ROOT / "viewer_client/desktop/translations/osteon_de.ts")
            self._german = {(context.findtext("name"), message.findtext("source")): message.findtext("translation")
                            for context in tree.iter("context") for message in context.iter("message")}

    def __call__(self, context, source, *values):
        text = (self._german[context, source] if self._german else source).replace("&", "")
        for number, value in enumerate(values, 1):
            text = text.replace(f"%{number}", str(value))
        return text


class Person:
    """One language: the window and its user."""

    def __init__(self, household, screen, programs, language, folder):
        self.words = Words(language)
        self.language, self.programs = language, programs
        self.screen, self.household = screen, household
        self.hands = desk.Hands(screen.environment)
        self.eyes = desk.Eyes(screen.environment["DBUS_SESSION_BUS_ADDRESS"])
        self.environment = dict(screen.environment)
        # The cases are shared by all languages, and the settings are not.
        for name, place in (("XDG_DATA_HOME", "data"), ("XDG_CONFIG_HOME", f"config-{language}"),
                            ("XDG_CACHE_HOME", "cache"), ("XDG_RUNTIME_DIR", "run"), ("HOME", "home")):
            (folder / place).mkdir(mode=0o700, exist_ok=True)
            self.environment[name] = str(folder / place)
        self.environment["PULSE_SERVER"] = f"unix:{folder}/nobody"
        self.home, self.data = folder / "home", folder / "data/osteon"
        self.starts = 0
        self.window = None

    # What a person waits for.
    def until(self, condition, what, patience_s=60.0):
        deadline = time.monotonic() + patience_s
        while True:
            found = condition()
            if found:
                return found
            self.household.check()
            if time.monotonic() > deadline:
                raise Failure(f"{self.language}: {what} did not come within {patience_s:.0f} s")
            time.sleep(0.15)

    def still(self, patience_s=8.0):
        """Waits until the picture stands still, but not for ever: something may blink."""
        deadline, before = time.monotonic() + patience_s, None
        while time.monotonic() < deadline:
            now = self.screen.pixels()
            if now == before:
                return now
            before = now
            time.sleep(0.4)
        return before

    def see(self, name, role=None, inside=None, patience_s=20.0, **more):
        return self.until(lambda: self.eyes.find(name, role, inside, **more), f"\"{name}\"", patience_s)

    def click(self, name, role=None, inside=None, **more):
        self.hands.click(self.eyes.middle(self.see(name, role, inside, **more)))

    def title(self, title, patience_s=60.0):
        self.until(lambda: any(one.startswith(title) for one in self.hands.titles()), f"a window \"{title}\"",
                   patience_s)

    def status(self, sentence, patience_s=30.0):
        """The sentence of the status bar. Its description is the whole sentence."""
        bars = self.eyes.statuses()
        self.until(lambda: any(self.eyes.description(bar).startswith(sentence) for bar in bars),
                   f"the sentence \"{sentence}\"", patience_s)

    # The window.
    def start(self, *arguments):
        self.starts += 1
        self.window = self.household.start(f"osteon-{self.language}-{self.starts}",
                                           [self.programs["osteon"], "--language", self.language, *arguments],
                                           self.environment)
        self.see(self.words("StartPage", "Bones to practise on"), "list")
        self.title("Osteon")

    def quit(self):
        self.window.may_end = True
        self.hands.keys("ctrl+q")
        if self.window.wait(20.0) != 0:
            raise Failure(f"{self.language}: the window ended with {self.window.exit_code}:", self.window.last_words())
        if left := [name for name in map(desk.program_of, desk.children()) if name.startswith("osteon")]:
            raise Failure(f"{self.language}: the window has left {', '.join(left)} behind")
