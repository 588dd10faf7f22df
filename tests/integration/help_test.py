"""Checks every program's --help, --version, man page and completion. OSTEON_BIN: the folder of the programs."""
import functools
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

BIN = Path(os.environ["OSTEON_BIN"])
SOURCE = Path(os.environ["OSTEON_SOURCE_DIR"])
PROGRAMS = ("osteon-import", "osteon-server", "osteon-haptic", "osteon-viewer", "osteon-audio")
WIDEST = 100  # columns


@functools.cache  # A start of a program takes 0.2 s of a processor.
def said(*command, bin_folder=None):
    environment = {**os.environ, "OSTEON_BIN": str(bin_folder or BIN)}
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, env=environment)
    if done.returncode != 0:
        raise AssertionError(f"{command}: exit code {done.returncode}: {done.stderr}")
    return done.stdout


def subcommands(text):
    listed = re.findall(r"^  ([a-z][a-z-]*) ", text.partition("Subcommands:")[2], re.M)
    others = re.search(r"Other commands: ([a-z, ]+) \(", " ".join(text.split()))
    return listed + (others[1].split(", ") if others else [])


def all_helps(*command, run=None):
    """Yields (command, its help) of a program and of all its subcommands. `run`: the file of the program."""
    text = said(run or command[0], *command[1:], "--help")
    yield command, text
    for name in subcommands(text):
        yield from all_helps(*command, name, run=run)


@functools.cache
def stand_ins():
    """A folder of scripts that say what the programs said. What nobody asked the program before, it is asked then."""
    folder = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(folder.cleanup)
    for program in (*PROGRAMS, "osteon"):
        said_before = Path(folder.name, f"{program}.said")
        said_before.mkdir()
        for command, text in all_helps(BIN / program):
            Path(said_before, " ".join([*command[1:], "--help"])).write_text(text, encoding="utf-8")
        Path(said_before, "--version").write_text(said(BIN / program, "--version"), encoding="utf-8")
        script = Path(folder.name, program)
        script.write_text('#!/bin/sh\n'
                          f'[ ! -f "$0.said/$*" ] || exec cat "$0.said/$*"\nexec "{BIN}/{program}" "$@"\n',
                          encoding="utf-8")
        script.chmod(0o755)
    return Path(folder.name)


def completed(program, *words):
    script = (f'. "{SOURCE}/deploy/completion.bash"; COMP_WORDS=({program} {" ".join(words)}); '
              f'COMP_CWORD={len(words)}; _osteon "{stand_ins() / program}" "{words[-1]}"; '
              'printf "%s\\n" "${COMPREPLY[@]}"')
    return said("bash", "-c", script).split()


class Help(unittest.TestCase):
    def test_fits_a_terminal(self):
        count = 0
        for program in PROGRAMS:
            for command, text in all_helps(BIN / program):
                count += 1
                for line in text.splitlines():
                    self.assertLessEqual(len(line), WIDEST, f"{command}: {line}")
        self.assertGreater(count, 40)

    def test_has_a_version(self):
        for program in PROGRAMS:
            self.assertRegex(said(BIN / program, "--version"), rf"^{program} \d+\.\d+\.\d+\n$")

    @unittest.skipUnless(shutil.which("help2man"), "help2man is not installed; deploy/install does that")
    def test_makes_a_man_page(self):
        with tempfile.TemporaryDirectory() as folder:
            said(SOURCE / "deploy" / "man", folder, bin_folder=stand_ins())
            pages = {page.stem: page.read_text(encoding="utf-8") for page in Path(folder, "man1").glob("*.1")}
        for program in PROGRAMS:
            for command, _ in all_helps(program, run=BIN / program):
                page = pages["-".join(command)]
                self.assertIn(".SH OPTIONS", page)
                self.assertIn(program, page)

    # Limits let it pass by themselves, because it is neither below nor above them.
    def test_every_number_with_limits_refuses_nan(self):
        tried = 0
        for program in PROGRAMS:
            for command, text in all_helps(BIN / program):
                words = " ".join(text.split())
                for option in re.finditer(r" (--[a-z-]+) [A-Z]+:NUMBER (?:in \[|or )(.*?)(?= --|$)", words):
                    times = re.match(r"[^\]]*\](?:=\S+)? x (\d)", option[2])
                    values = ["nan"] * int(times[1] if times else 1)
                    done = subprocess.run([*map(str, command), option[1], *values], capture_output=True, text=True,
                                          check=False, timeout=60)
                    self.assertNotEqual(done.returncode, 0, f"{command} {option[1]}")
                    self.assertRegex(done.stderr, rf"^osteon[a-z -]*: {option[1]}: nan is not a number .*\n$", command)
                    tried += 1
        self.assertGreater(tried, 20)

    # A check of CLI11 that lets nan pass shows in the help.
    def test_no_limits_are_of_the_library(self):
        for program in PROGRAMS:
            for command, text in all_helps(BIN / program):
                self.assertNotRegex(" ".join(text.split()), "FLOAT:(FLOAT in|POSITIVE|NONNEGATIVE)", command)

    def test_completes(self):
        self.assertIn("erase-person", completed("osteon-server", "er"))
        self.assertIn("create", completed("osteon-server", "rooms", ""))
        self.assertIn("--case-hash", completed("osteon-server", "rooms", "create", "--ca"))
        self.assertIn("plan", completed("osteon-haptic", "pl"))
        self.assertIn("analyse", completed("osteon-audio", "an"))
        self.assertIn("devices", completed("osteon-audio", "de"))
        self.assertIn("--hrtf", completed("osteon-audio", "--hr"))
        self.assertIn("--displacement", completed("osteon-audio", "analyse", "--di"))
        self.assertIn("--refine", completed("osteon-audio", "model", "--re"))
        self.assertIn("resynthesise", completed("osteon-audio", "res"))
        self.assertIn("preset", completed("osteon-audio", "pr"))
        self.assertIn("--preset", completed("osteon-audio", "--pr"))
        self.assertIn("--overwrite", completed("osteon-audio", "record", "--ov"))
        self.assertIn("--seed", completed("osteon-audio", "render", "--se"))
        self.assertIn("--hrtf", completed("osteon-audio", "render", "--hr"))
        self.assertIn("--timeout", completed("osteon-viewer", "--ti"))
        self.assertIn("--language", completed("osteon", "--la"))
        self.assertEqual(completed("osteon-viewer", "--nothing-like-it"), [])


if __name__ == "__main__":
    unittest.main()
