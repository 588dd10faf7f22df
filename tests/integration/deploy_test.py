"""The scripts under deploy/ where they were not made for: a moved checkout, another user's, two at a time."""
import fcntl
import io
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import zipfile
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(os.environ["OSTEON_SOURCE_DIR"])
BIN = Path(os.environ["OSTEON_BIN"])
sys.path[:0] = [str(ROOT / "deploy"), str(ROOT / "deploy/session")]

import components  # noqa: E402  (found through the path above)
import demo  # noqa: E402

PRESETS = """{
  "version": 5,
  "configurePresets": [
    { "name": "dev", "generator": "Ninja", "binaryDir": "${sourceDir}/build/dev" }
  ],
  "buildPresets": [
    { "name": "dev", "configurePreset": "dev" }
  ]
}
"""
PROJECT = """cmake_minimum_required(VERSION 3.25)
project(nothing LANGUAGES NONE)
add_custom_target(built ALL COMMAND ${CMAKE_COMMAND} -E touch ${CMAKE_SOURCE_DIR}/built)
"""
NOBODY = 65534
NO_SCREEN = "--try needs a screen, and no display opens; start it in a terminal of a desktop"


def ended(command, **options):
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, **options)


def by_another_user(command):
    """Root tries as nobody. In some chroots / is closed to all but root; there nobody gets the right to enter it."""
    if os.geteuid() != 0:
        return command
    enters = [] if os.stat("/").st_mode & 0o001 else ["--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"]
    return ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", *enters, "--", *command]


def is_running(process: int):
    try:
        status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8")
    except FileNotFoundError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


def ends(process: int):
    """A signal that was sent needs a moment to arrive on a busy machine."""
    for _ in range(500):
        if not is_running(process):
            return True
        time.sleep(0.02)
    return False


def hear_interrupts():
    """A shell that runs in the background ignores them, and so would the programs that it starts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class Checkout(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.parent = Path(folder.name)
        self.parent.chmod(0o755)
        self.checkout = self.parent / "osteon"
        (self.checkout / "deploy").mkdir(parents=True)
        for name in ("build", "environment.sh"):
            shutil.copy(ROOT / "deploy" / name, self.checkout / "deploy")
        (self.checkout / "CMakePresets.json").write_text(PRESETS, encoding="utf-8")
        (self.checkout / "CMakeLists.txt").write_text(PROJECT, encoding="utf-8")

    def test_one_that_was_moved_is_built_anew(self):
        first = ended([self.checkout / "deploy/build"])
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertNotIn("moved", first.stdout)
        moved = self.checkout.rename(self.parent / "elsewhere")
        (moved / "built").unlink()
        second = ended([moved / "deploy/build"])
        self.assertEqual(second.returncode, 0, second.stderr)
        self.assertIn("was moved", second.stdout)
        self.assertTrue((moved / "built").exists())
        self.assertNotIn("moved", ended([moved / "deploy/build"]).stdout)

    def test_one_of_another_user_says_so_in_one_line(self):
        self.checkout.chmod(0o555)
        self.addCleanup(self.checkout.chmod, 0o755)
        tried = ended(by_another_user([self.checkout / "deploy/build"]))
        self.assertEqual(tried.returncode, 1)
        self.assertEqual(tried.stdout, "")
        self.assertRegex(tried.stderr, r"\Adeploy/build: \S+ cannot write into .*make your own clone\n\Z")
        self.assertFalse((self.checkout / "build").exists())


class Budget(unittest.TestCase):
    """deploy/test in a checkout whose build and tests take no time."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.deploy = Path(folder.name) / "deploy"
        self.deploy.mkdir()
        shutil.copy(ROOT / "deploy/environment.sh", self.deploy)
        for name in ("install", "build"):
            self.program(name, "exit 0")

    def program(self, name, text):
        (self.deploy / name).write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
        (self.deploy / name).chmod(0o755)

    def run_script(self, *options, build_budget=720, ctest="exit 0"):
        script = (ROOT / "deploy/test").read_text(encoding="utf-8")
        self.assertIn("build_budget=720 ", script)
        self.program("ctest", ctest)
        test = self.deploy / "test"
        test.write_text(script.replace("build_budget=720 ", f"build_budget={build_budget} "), encoding="utf-8")
        test.chmod(0o755)
        return ended([test, *options], env={**os.environ, "PATH": f"{self.deploy}:{os.environ['PATH']}"})

    def test_is_printed_and_kept(self):
        kept = self.run_script("--budget")
        self.assertEqual((kept.returncode, kept.stderr), (0, ""))
        self.assertRegex(kept.stdout, r"\nBuild \d+ s of 720, tests \d+ s of 780\n\Z")

    def test_that_is_exceeded_fails_if_asked_for(self):
        told = self.run_script(build_budget=-1)
        self.assertEqual(told.returncode, 0)
        self.assertRegex(told.stderr, r"\AOVER BUDGET: .*\n\Z")
        failed = self.run_script("--budget", build_budget=-1)
        self.assertEqual(failed.returncode, 1)
        self.assertEqual(failed.stderr, told.stderr)

    def test_does_not_hide_a_failed_test(self):
        for budget in (720, -1):
            for options in ((), ("--budget",)):
                self.assertEqual(self.run_script(*options, build_budget=budget, ctest="exit 8").returncode, 8)

    def test_counts_cases_and_names_the_skipped(self):
        log = "build/dev/Testing/Temporary/LastTest.log"
        suites = ("[==========] 3 tests from 2 test suites ran. (5 ms total)\n"
                  "[  SKIPPED ] Scans.Skull (0 ms)\n[  SKIPPED ] 1 test, listed below:\n[  SKIPPED ] Scans.Skull\n"
                  "[==========] 1 test from 1 test suite ran. (0 ms total)\n")
        told = self.run_script(ctest=f"mkdir -p $(dirname {log}); cat >{log} <<'END'\n{suites}END")
        self.assertIn("\n4 cases of GoogleTest, 1 skipped\n  skipped: Scans.Skull\n", told.stdout)

    def test_leaves_other_options_to_ctest(self):
        told = self.run_script("--budget", "-R", "unit", ctest='echo "given: $*"')
        self.assertRegex(told.stdout, "given: .* -R unit\n")


class Secrets(unittest.TestCase):
    def test_git_ignores_those_of_the_security_chapter(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["git", "init", "-q", folder], check=True)
            shutil.copy(ROOT / ".gitignore", folder)
            for name in ("certs/authority/tickets.key", "certs/people/anna/person.key", "anna.ticket"):
                ignored = ended(["git", "-C", folder, "check-ignore", "-q", name])
                self.assertEqual(ignored.returncode, 0, name)
            kept = ended(["git", "-C", folder, "check-ignore", "-q", "deploy/certs"])
            self.assertEqual(kept.returncode, 1, "the script of that name belongs to the project")


class Packages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.checkout = Path(folder.name).resolve() / "osteon"
        (self.checkout / "deploy").mkdir(parents=True)
        for name in ("package", "environment.sh"):
            shutil.copy(ROOT / "deploy" / name, self.checkout / "deploy")

    def refused(self, *options, by=list):
        tried = ended(by([self.checkout / "deploy/package", *options]))
        self.assertEqual(tried.returncode, 1)
        self.assertEqual(tried.stdout, "")
        self.assertEqual(tried.stderr.count("\n"), 1, tried.stderr)
        return tried.stderr

    def test_are_of_a_commit(self):
        self.assertRegex(self.refused(), r"\Adeploy/package: .*/osteon is no git repository\n")
        git = ["git", "-C", self.checkout, "-c", "user.name=x", "-c", "user.email=x@x.invalid"]
        subprocess.run([*git, "init", "-q"], check=True)
        self.assertRegex(self.refused(), "is no git repository")
        subprocess.run([*git, "add", "."], check=True)
        subprocess.run([*git, "commit", "-qm", "Begin"], check=True)
        self.assertRegex(self.refused(), r"\Adeploy/package: the commit \w{8} has no deploy/debian\n")

    def script(self, file: Path, text):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("#!/bin/sh\n" + text, encoding="utf-8")
        file.chmod(0o755)

    def test_stop_at_once_and_keep_the_last_ones(self):
        shutil.copy(ROOT / "CMakeLists.txt", self.checkout)
        shutil.copytree(ROOT / "deploy/debian", self.checkout / "deploy/debian")
        self.script(self.checkout / "deploy/install", "exit 0\n")
        # A build that takes long, in a process of a process.
        tools, begun = self.checkout.parent / "tools", self.checkout.parent / "begun"
        self.script(tools / "dpkg-buildpackage", f"echo '[3/20] Building'\nsleep 600 &\necho $! >{begun}\nwait\n")
        git = ["git", "-C", self.checkout, "-c", "user.name=x", "-c", "user.email=x@x.invalid"]
        for command in (["init", "-q"], ["add", "."], ["commit", "-qm", "Begin"]):
            subprocess.run([*git, *command], check=True)
        last = self.checkout / "out/packages/osteon_1.deb"
        last.parent.mkdir(parents=True)
        last.write_text("of the last run", encoding="utf-8")
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            begun.unlink(missing_ok=True)
            running = subprocess.Popen([self.checkout / "deploy/package"], stdin=subprocess.DEVNULL, text=True,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                       env={**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"},
                                       preexec_fn=hear_interrupts)
            self.addCleanup(running.kill)
            while not (begun.exists() and begun.read_text(encoding="utf-8").strip()):
                self.assertIsNone(running.poll(), "it ended before it built")
                time.sleep(0.02)
            running.send_signal(number)  # to the script alone, as another program does it
            said, complaint = running.communicate(timeout=60)
            self.assertEqual(running.returncode, code, complaint)
            self.assertRegex(complaint, r"\Adeploy/package: stopped; .*/out/packages is as it was\n\Z")
            self.assertIn("Building packages: 3 of 20", said)
            self.assertTrue(ends(int(begun.read_text(encoding="utf-8"))))
            self.assertEqual(last.read_text(encoding="utf-8"), "of the last run")

    def test_are_tried_by_root_alone(self):
        self.assertRegex(self.refused("--tri"), "takes --try")
        self.checkout.parent.chmod(0o755)
        self.assertRegex(self.refused("--try", by=by_another_user), "only root")

    def test_components_have_escaped_addresses(self):
        self.assertEqual(components.purl("libstdc++6", "1:12.2~rc1+deb12", "amd64", "debian"),
                         "pkg:deb/debian/libstdc%2B%2B6@1%3A12.2~rc1%2Bdeb12?arch=amd64")
        known = {"libc6": "c", "libx2": "x"}
        about = {"Depends": "libx1 | libx2, libc6 (>= 2.36), other:any"}
        self.assertEqual(components.depends(about, known), ["c", "x"])


class Filmed(unittest.TestCase):
    """Filmed is only where all is there. The films themselves are for a quiet machine with the packages."""

    def refused(self, film, programs, path):
        with tempfile.TemporaryDirectory() as folder:
            done = ended([ROOT / "tests/packages" / film, "--bin", programs, Path(folder, "film")],
                         env={**os.environ, "PATH": str(path)})
            self.assertEqual((done.returncode, done.stdout, os.listdir(folder)), (1, "", []))
        return done.stderr

    def test_needs_the_programs(self):
        with tempfile.TemporaryDirectory() as empty:
            for film in ("film", "segment"):
                self.assertRegex(self.refused(film, empty, os.environ["PATH"]),
                                 rf"\A{film}: there is no osteon in .*--bin FOLDER\n\Z")

    def test_needs_a_screen_and_hands(self):
        with tempfile.TemporaryDirectory() as folder:
            for missing, package in (("Xvfb", "xvfb"), ("xdotool", "xdotool")):
                for name in ("Xvfb", "openbox", "xdotool", "dbus-daemon"):
                    program = Path(folder, name)
                    program.touch(mode=0o755)
                Path(folder, missing).unlink()
                for film in ("film", "segment"):
                    self.assertEqual(self.refused(film, BIN, folder),
                                     f"{film}: the package {package} is not installed; apt-get install {package}\n")


class Desktop(unittest.TestCase):
    def setUp(self):
        self.folder = ROOT / "deploy/desktop"
        names = {"m": "http://www.freedesktop.org/standards/shared-mime-info"}
        self.kind = ElementTree.parse(self.folder / "osteon-case.xml").getroot().find("m:mime-type", names)
        self.glob = self.kind.find("m:glob", names).get("pattern")
        self.magic = [(int(match.get("offset")), match.get("value").encode().decode("unicode_escape").encode("latin-1"))
                      for match in self.kind.iterfind(".//m:match", names)]

    def test_the_window_opens_the_type_of_a_case_file(self):
        entry = (self.folder / "osteon.desktop").read_text(encoding="utf-8")
        self.assertIn(f"MimeType={self.kind.get('type')};\n", entry)
        self.assertIn("Exec=osteon %f\n", entry)
        self.assertEqual(self.glob, "*.osteon")

    def test_the_package_has_it(self):
        self.assertIn("usr/share/mime/packages/osteon-case.xml\n",
                      (ROOT / "deploy/debian/osteon.install").read_text(encoding="utf-8"))

    def test_the_magic_is_that_of_a_zip_with_case_json_first(self):
        def known(*names):
            made = io.BytesIO()
            with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
                for name in names:
                    archive.writestr(name, "{}")
            return all(made.getvalue()[at:].startswith(value) for at, value in self.magic)
        self.assertTrue(known("case.json", "bone.vdb"))
        self.assertFalse(known("bone.vdb", "case.json"))
        self.assertFalse(known("holiday.jpg"))


class Nightly(unittest.TestCase):
    """The step of the mutations, with a compiler that only copies. And what the other steps name."""

    MUTATIONS = """from run import Mutation as M
MUTATIONS = [M("twice.txt", "2 * x", "3 * x", "it is thrice", "unit", "*"),
             M("twice.txt", "int", "long", "it is long", "unit", "*")]
"""
    PROGRAM = """case $1 in --gtest_list_tests) printf 'Twice.\\n  IsTwice\\n'; exit;; esac
grep -q '%s' ../../twice.txt || { echo '[  FAILED  ] Twice.IsTwice'; exit 1; }
"""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.parent = Path(folder.name).resolve()
        self.checkout, self.tools = self.parent / "osteon", self.parent / "tools"
        for name in ("deploy/nightly", "deploy/environment.sh", "tests/mutations/run.py", ".gitignore"):
            (self.checkout / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.checkout / name)
        (self.checkout / "tests/mutations/mutations.py").write_text(self.MUTATIONS, encoding="utf-8")
        (self.checkout / "twice.txt").write_text("int twice(auto x) { return 2 * x; }\n",
                                                 encoding="utf-8")
        subprocess.run(["git", "init", "-q", self.checkout], check=True)
        self.script("program", self.PROGRAM % "int.*2 [*] x")

    def script(self, name, text):
        self.tools.mkdir(exist_ok=True)
        (self.tools / name).write_text("#!/bin/sh\n" + text, encoding="utf-8")
        (self.tools / name).chmod(0o755)

    def command(self, cmake):
        self.script("cmake", cmake)
        return {"args": [self.checkout / "deploy/nightly", "--only", "mutations"],
                "env": {**os.environ, "PATH": f"{self.tools}:{os.environ['PATH']}"}}

    def mutated(self):
        command = self.command(f"mkdir -p build/dev/bin\ncp {self.tools}/program build/dev/bin/unit\n")
        return ended(command["args"], env=command["env"])

    def test_says_how_many_mutations_were_caught(self):
        sound = self.mutated()
        self.assertEqual(sound.returncode, 0, sound.stdout + sound.stderr)
        self.assertRegex(sound.stdout, r"\Amutations +\d+ s  2 of 2 caught\n\Z")
        self.assertEqual(list((self.checkout / "out/nightly/finds").iterdir()), [])

    def test_a_mutation_that_survives_is_a_find(self):
        self.script("program", self.PROGRAM % "2 [*] x")
        found = self.mutated()
        self.assertEqual(found.returncode, 1)
        self.assertRegex(found.stdout, r"\Amutations +\d+ s  1 of 2 caught, FAILED\n\Z")
        log = (self.checkout / "out/nightly/finds/mutations.log").read_text(encoding="utf-8")
        self.assertIn("1 caught, 1 survived", log)

    def test_a_signal_ends_the_build_of_a_mutation(self):
        begun = self.parent / "begun"
        command = self.command(f"echo $$ >{begun}\nexec sleep 600\n")
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            begun.unlink(missing_ok=True)
            running = subprocess.Popen(**command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                       preexec_fn=hear_interrupts)
            self.addCleanup(running.kill)
            while not (begun.exists() and begun.read_text(encoding="utf-8").strip()):
                self.assertIsNone(running.poll(), "it ended before it built")
                time.sleep(0.02)
            running.send_signal(number)
            self.assertEqual(running.wait(60), code)
            self.assertTrue(ends(int(begun.read_text(encoding="utf-8"))))

    def test_names_programs_and_libraries_that_there_are(self):
        script = (ROOT / "deploy/nightly").read_text(encoding="utf-8")
        named = {name: set(re.search(rf"^{name}=\(([^)]*)\)", script, re.MULTILINE)[1].split())
                 for name in ("asan_tests", "tsan_tests", "lint_targets")}
        listed = [path for folder in ("common", "server", "haptic_client", "viewer_client", "audio_client", "tests")
                  for path in (ROOT / folder).rglob("CMakeLists.txt")]
        texts = {path.relative_to(ROOT): path.read_text(encoding="utf-8") for path in listed}
        tests = {name for text in texts.values() for name in re.findall(r"^osteon_test\(([\w.]+)", text, re.MULTILINE)}
        self.assertLessEqual(named["asan_tests"] | named["tsan_tests"], tests)
        libraries = {path: {f"osteon_{name}" for name in re.findall(r"^osteon_library\((\w+)", text, re.MULTILINE)}
                     for path, text in texts.items() if path.parts[0] != "tests"}
        self.assertLessEqual(named["lint_targets"], set().union(*libraries.values()))
        clients = [found for path, found in libraries.items()
                   if path.parts[0].endswith("_client") or path.parent == Path("common/wire")]
        self.assertGreater(len(clients), 10)
        self.assertLessEqual(set().union(*clients), named["lint_targets"])


class DemoOfAPhantom(unittest.TestCase):
    def test_wrong_bones_are_one_sentence(self):
        for wrong, sentence in (
                (["--bone", "skull"], "--bone: there is no phantom of a 'skull'; "
                                      "take femur, tibia, patella, pelvis, hip or knee"),
                (["--bone", "patella", "--together"], "--together: a patella has no room for two surgeons; "
                                                      "take another bone"),
                (["--bone", "femur", "--case", "/"], "--case and --bone both name a bone; give one of them"),
                (["--bone"], "--bone needs a value"),
                (["--try", "--together"], "--try is for your own hand, and --together for simulated ones; "
                                          "give one of them"),
                (["--try", "--out", "folder"], "--try writes no report; leave --out away"),
                (["--try", "--bone", "femur"], NO_SCREEN)):
            tried = ended([ROOT / "deploy/demo", *wrong], env=without_display())
            self.assertNotEqual(tried.returncode, 0)
            self.assertEqual((tried.stdout, tried.stderr), ("", f"deploy/demo: {sentence}\n"))

    def test_the_importer_makes_it_once(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "bin").mkdir()
            importer = folder / "bin/osteon-import"
            importer.write_text("#!/bin/sh\necho \"$1 $2 $3\" >>\"$0.runs\"\nmkdir \"$4\"\n: >\"$4/case.json\"\n",
                                encoding="utf-8")
            importer.chmod(0o755)
            self.addCleanup(setattr, demo, "ROOT", demo.ROOT)
            demo.ROOT = folder
            first = demo.phantom_case("femur", folder / "bin")
            self.assertEqual(demo.phantom_case("femur", folder / "bin"), first)
            self.assertNotEqual(demo.phantom_case("tibia", folder / "bin"), first)
            self.assertEqual((folder / "bin/osteon-import.runs").read_text(encoding="utf-8"),
                             "phantom femur --out\nphantom tibia --out\n")


def without_display():
    return {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}


class DemoOnAScreen(unittest.TestCase):
    """deploy/demo in a checkout whose build takes no time. It writes down what it was to build."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.checkout = Path(folder.name)
        self.bin = self.checkout / "build/dev/bin"
        self.bin.parent.mkdir(parents=True)
        (self.checkout / "deploy").mkdir()
        for name in ("demo", "environment.sh"):
            shutil.copy(ROOT / "deploy" / name, self.checkout / "deploy")
        shutil.copytree(ROOT / "deploy/session", self.checkout / "deploy/session")
        self.program(self.checkout / "deploy/install", "exit 0")
        self.program(self.checkout / "deploy/build", 'echo "$*" >"$(dirname "$0")/built"')
        self.environment = without_display()
        for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_RUNTIME_DIR"):
            (self.checkout / name).mkdir(mode=0o700)
            self.environment[name] = str(self.checkout / name)

    @staticmethod
    def program(file, text):
        file.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
        file.chmod(0o755)

    def fake_programs(self, window):
        self.bin.mkdir()
        self.program(self.bin / "osteon-import", 'mkdir "$4"\n: >"$4/case.json"')
        self.program(self.bin / "osteon", f'echo "$*" >"$0.told"\n{window}')

    def open_screen(self):
        screen = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1280x900x24", "-nolisten", "tcp"],
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                  text=True)
        self.addCleanup(screen.stdout.close)
        self.addCleanup(screen.wait)
        self.addCleanup(screen.terminate)
        self.environment.update(DISPLAY=f":{screen.stdout.readline().strip()}", LIBGL_ALWAYS_SOFTWARE="1")

    def demo(self, *options):
        return ended([self.checkout / "deploy/demo", *options], env=self.environment)

    def built(self):
        return (self.checkout / "deploy/built").read_text(encoding="utf-8").split()

    def start(self, *options):
        running = subprocess.Popen([self.checkout / "deploy/demo", *options], env=self.environment,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   text=True, preexec_fn=hear_interrupts)
        self.addCleanup(running.stdout.close)
        self.addCleanup(running.wait)
        self.addCleanup(running.kill)
        return running

    def test_a_stale_display_is_one_sentence_before_the_build(self):
        self.environment["DISPLAY"] = ":987654"
        tried = self.demo("--try", "--bone", "femur")
        self.assertNotEqual(tried.returncode, 0)
        self.assertEqual((tried.stdout, tried.stderr), ("", f"deploy/demo: {NO_SCREEN}\n"))
        self.assertFalse((self.checkout / "deploy/built").exists())

    def test_builds_the_window_only_where_a_screen_can_show_it(self):
        self.fake_programs("exit 0")
        self.program(self.bin / "osteon-import", "echo no such bone >&2; exit 1")
        self.assertEqual(self.demo("--bone", "femur").returncode, 1)
        self.assertEqual(set(self.built()),
                         {"dev", "osteon-import", "osteon-server", "osteon-haptic", "osteon-audio", "osteon-viewer"})
        self.open_screen()
        self.assertEqual(self.demo("--bone", "femur").returncode, 1)
        self.assertIn("osteon", self.built())
        self.demo("--bone", "femur", "--try")
        self.assertEqual(set(self.built()),
                         {"dev", "osteon-import", "osteon-server", "osteon-haptic", "osteon-audio", "osteon"})

    def test_the_window_gets_the_bone_and_the_drill_and_closing_it_ends_the_demo(self):
        self.fake_programs("exit 0")
        self.open_screen()
        tried = self.demo("--bone", "femur", "--try")
        self.assertEqual((tried.returncode, tried.stderr), (0, ""))
        case, *how = (self.bin / "osteon.told").read_text(encoding="utf-8").split()
        self.assertTrue((Path(case) / "case.json").exists())
        self.assertEqual(how, ["--tool", "drill-3.2"])
        self.assertRegex(tried.stdout, r"\nMove the mouse .*\nHold the left button .*\nClose the window.*\n\Z")
        self.assertFalse((self.checkout / "out").exists())

    def test_a_window_that_fails_is_one_sentence(self):
        self.fake_programs("exit 3")
        self.open_screen()
        tried = self.demo("--bone", "femur", "--try")
        self.assertEqual((tried.returncode, tried.stderr), (1, "deploy/demo: the window ended with 3\n"))

    def test_an_interrupt_ends_the_real_window_and_its_children(self):
        self.bin.symlink_to(BIN)
        case = self.checkout / "block"
        made = ended([BIN / "osteon-import", "phantom", "block", "--layers", "5:1.9,20:0.3,5:1.9", "--width", "40",
                      "--pitch", "0.5", "--out", case])
        self.assertEqual(made.returncode, 0, made.stderr)
        self.open_screen()
        running = self.start("--try", "--case", case)
        deadline = time.monotonic() + 120
        while not {"osteon", "osteon-server", "osteon-haptic"} <= set(programs_of(self.checkout).values()):
            self.assertIsNone(running.poll(), "it ended before its window was open")
            self.assertLess(time.monotonic(), deadline, str(programs_of(self.checkout)))
            time.sleep(0.05)
        started = programs_of(self.checkout)
        running.send_signal(signal.SIGINT)
        self.assertEqual(running.wait(60), 130)
        self.assertTrue(running.stdout.read().endswith("deploy/demo: stopped; every program has been ended\n"))
        self.assertEqual([name for process, name in started.items() if not ends(process)], [])


def programs_of(checkout):
    """The programs that run with this checkout's folder of data, by process id."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if f"XDG_DATA_HOME={checkout}/".encode() in (folder / "environ").read_bytes():
                found[int(folder.name)] = Path(os.readlink(folder / "exe")).name
        except OSError:
            pass  # it has ended
    return found


class TwoDemos(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def test_the_second_leaves_the_folder_of_the_first_alone(self):
        out = self.folder / "out"
        out.mkdir()
        (out / "report.html").write_text("of the first", encoding="utf-8")
        command = [sys.executable, "-EB", ROOT / "deploy/session/demo.py", "--out", out, "--build", self.folder,
                   "--case", self.folder]
        with open(out / ".osteon-session", "w", encoding="utf-8") as first:
            fcntl.flock(first, fcntl.LOCK_EX)
            second = ended(command)
        self.assertEqual(second.returncode, 1)
        self.assertRegex(second.stderr, r"\Adeploy/demo: another demo writes into .*--out\n\Z")
        self.assertEqual((out / "report.html").read_text(encoding="utf-8"), "of the first")

    def test_a_folder_that_cannot_be_made_is_named(self):
        (self.folder / "file").touch()
        tried = ended([sys.executable, "-EB", ROOT / "deploy/session/demo.py", "--out", self.folder / "file/out",
                       "--build", self.folder])
        self.assertEqual(tried.returncode, 1)
        self.assertRegex(tried.stderr, r"\Adeploy/demo: .*file.*: Not a directory\n\Z")

    def test_both_import_the_same_files_once(self):
        (self.folder / "bin").mkdir()
        (self.folder / "ct").mkdir()
        importer = self.folder / "bin/osteon-import"
        importer.write_text("#!/bin/sh\necho run >>\"$0.runs\"\nsleep 0.3\nmkdir \"$4\"\n: >\"$4/case.json\"\n",
                            encoding="utf-8")
        importer.chmod(0o755)
        root, demo.ROOT, found = demo.ROOT, self.folder, []
        self.addCleanup(setattr, demo, "ROOT", root)
        threads = [threading.Thread(target=lambda: found.append(
            demo.prepare_case(self.folder / "ct", self.folder / "bin", []))) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(set(found)), 1)
        self.assertTrue((found[0] / "case.json").exists())
        self.assertEqual((self.folder / "bin/osteon-import.runs").read_text(encoding="utf-8"), "run\n")


if __name__ == "__main__":
    unittest.main()
