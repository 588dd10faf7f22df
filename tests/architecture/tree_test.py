"""Checks every source file by the layers and sizes of the design, and shows that each rule can fail."""
import os
import re
import shutil
import subprocess
import unittest
from pathlib import Path

import packages
import references
import style
import tree

ROOT = Path(os.environ.get("OSTEON_SOURCE_DIR", Path(__file__).resolve().parents[2]))


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


class TheTree(unittest.TestCase):
    def all_faults(self, check):
        files = tree.source_files(ROOT)
        self.assertGreater(len(files), 20, f"no sources found under {ROOT}")
        return [fault for f in files for fault in check(relative(f), f.read_text(encoding="utf-8"))]

    def test_includes_follow_the_layers(self):
        self.assertEqual(self.all_faults(tree.layer_faults), [])

    def test_links_follow_the_layers(self):
        files = (f for folder in ("common", *tree.PROGRAMS) for f in (ROOT / folder).rglob("CMakeLists.txt"))
        texts = {relative(f): f.read_text(encoding="utf-8") for f in files}
        folders = tree.library_folders(texts)
        self.assertGreater(len(folders), 40)
        self.assertEqual([fault for item in texts.items() for fault in tree.link_faults(*item, folders)], [])

    def test_unit_tests_mirror_the_tree(self):
        folders = {relative(f.parent) for f in tree.source_files(ROOT)} | set(tree.PROGRAMS)
        self.assertEqual(self.all_faults(lambda path, _text: tree.mirror_faults(path, folders)), [])

    def test_locks_are_checked(self):
        self.assertEqual(self.all_faults(tree.lock_faults), [])

    def test_ranks_of_locks_are_described(self):
        ranks = tree.lock_ranks((ROOT / tree.LOCK_RANKS).read_text(encoding="utf-8"))
        self.assertGreater(len(ranks), 10)
        page = (ROOT / "deploy/docs/architecture.md").read_text(encoding="utf-8")
        self.assertEqual(tree.rank_rows(page), ranks)

    def test_files_are_short(self):
        self.assertEqual(self.all_faults(tree.size_faults), [])

    def test_every_file_is_built(self):
        def check(path, _text):
            cmake, source = (ROOT / path).parent / "CMakeLists.txt", (ROOT / path).with_suffix(".cpp")
            return tree.declaration_faults(path, cmake.read_text() if cmake.exists() else "",
                                           source.read_text() if source.exists() else None)
        self.assertEqual(self.all_faults(check), [])

    def test_every_suite_is_registered(self):
        self.assertEqual(self.all_faults(tree.suite_faults), [])

    def test_every_source_is_listed(self):
        listed = (ROOT / references.LIST).read_text(encoding="utf-8")
        examples = (references.LIST, "tests/architecture/references.py", "tests/architecture/tree_test.py")
        files = [f for f in references.text_files(ROOT) if relative(f) not in examples]
        faults = [fault for f in files
                  for fault in references.reference_faults(relative(f), f.read_text(encoding="utf-8"), listed)]
        self.assertEqual(faults, [])


class TheStyle(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.texts = {}
        for file in style.tracked_files(ROOT):
            try:
                cls.texts[relative(file)] = file.read_text(encoding="utf-8")
            except UnicodeDecodeError:
                continue

    def test_lines_are_narrow(self):
        self.assertEqual([fault for item in self.texts.items() for fault in style.width_faults(*item)], [])

    def test_cmake_lists_one_source_on_a_line(self):
        self.assertEqual([fault for item in self.texts.items() for fault in style.cmake_faults(*item)], [])

    def test_replaced_names_are_gone(self):
        retired = style.retired_names(self.texts[style.GLOSSARY])
        self.assertGreater(len(retired), 20)
        faults = [fault for path, text in self.texts.items() if path not in style.MAY_NAME_THEM
                  for fault in style.name_faults(path, text, retired)]
        self.assertEqual(faults, [])

    def test_long_functions_have_a_reason(self):
        listed = dict(re.match(r"(\S+ \S+): (.+)", line).groups()
                      for line in self.texts[style.LONG_FUNCTIONS].splitlines() if line and not line.startswith("#"))
        found = {f"{path} {name}" for path, text in self.texts.items() for name, _ in style.long_functions(path, text)}
        self.assertEqual(found - set(listed), set(), "break these up, or say why not")
        self.assertEqual(set(listed) - found, set(), "these are short now")

    @unittest.skipUnless((ROOT / ".git").exists(), "no repository")
    def test_subjects_of_commits_are_imperatives(self):
        log = subprocess.run(["git", "-C", str(ROOT), "log", "--no-merges", "--format=%s", f"{style.SINCE}..HEAD"],
                             capture_output=True, text=True, check=False)
        if log.returncode != 0:
            self.skipTest("the repository does not reach back to the commit from which on this holds")
        self.assertEqual([fault for subject in log.stdout.splitlines() for fault in style.subject_faults(subject)], [])

    @unittest.skipUnless(shutil.which("clang-format"), "clang-format is not installed; deploy/install does that")
    def test_code_is_formatted(self):
        files = [str(ROOT / path) for path in self.texts if path.endswith((".cpp", ".hpp", ".inl"))]
        said = subprocess.run(["clang-format", "--dry-run", "-Werror", "--style=file", *files], capture_output=True,
                              text=True, check=False)
        self.assertEqual(said.returncode, 0, said.stderr[:4000])


class ThePackages(unittest.TestCase):
    def setUp(self):
        self.debian = ROOT / "deploy/debian"
        self.control = (self.debian / "control").read_text(encoding="utf-8")

    def test_each_program_is_in_one(self):
        files = (f for folder in tree.PROGRAMS for f in (ROOT / folder).rglob("CMakeLists.txt"))
        found = packages.programs([f.read_text(encoding="utf-8") for f in files])
        self.assertGreater(len(found), 4)
        lists = {name: (self.debian / f"{name}.install").read_text(encoding="utf-8")
                 for name in packages.packages(self.control)}
        self.assertEqual(packages.install_faults(found, lists, (ROOT / "deploy/completion.bash").read_text(),
                                                 (ROOT / "deploy/man").read_text()), [])

    def test_each_list_belongs_to_one(self):
        # PACKAGE.install, PACKAGE.docs and so on; debhelper ignores others without a word.
        of_packages = {f.name.rpartition(".")[0] for f in self.debian.glob("*.*") if f.is_file()}
        self.assertEqual(of_packages - set(packages.packages(self.control)), set())

    def test_what_they_need_is_installed(self):
        needed = set(packages.build_dependencies(self.control)) - {"debhelper-compat"}  # of debhelper itself
        self.assertGreater(len(needed), 20)
        self.assertEqual(needed - packages.listed_packages((ROOT / "deploy/packages.txt").read_text()), set())


class TheRules(unittest.TestCase):
    def faults(self, path, include):
        return tree.layer_faults(path, f'#include "{include}"\n')

    def test_lower_layers_do_not_see_higher_ones(self):
        self.assertTrue(self.faults("common/field/kernel.cpp", "common/volume/case.hpp"))
        self.assertTrue(self.faults("common/core/x.hpp", "common/geometry/pose.hpp"))
        self.assertTrue(self.faults("common/sound/x.cpp", "common/runtime/log.hpp"))
        self.assertFalse(self.faults("common/volume/case.cpp", "common/field/cut.hpp"))

    def test_programs_do_not_see_each_other(self):
        self.assertTrue(self.faults("viewer_client/app/main.cpp", "server/room/room.hpp"))
        self.assertTrue(self.faults("common/wire/x.cpp", "server/room/room.hpp"))
        self.assertFalse(self.faults("server/rooms/x.cpp", "server/room/room.hpp"))

    def test_logic_does_not_see_the_network_or_main(self):
        self.assertTrue(self.faults("server/room/room.cpp", "server/rpc/services.hpp"))
        self.assertTrue(self.faults("server/rooms/rooms.cpp", "server/rpc/services.hpp"))
        self.assertTrue(self.faults("server/auth/authorizer.cpp", "server/rooms/rooms.hpp"))
        self.assertTrue(self.faults("server/publish/x.cpp", "server/storage/room_store.hpp"))
        self.assertTrue(self.faults("server/new/x.cpp", "server/room/room.hpp"))
        self.assertTrue(self.faults("haptic_client/net/x.cpp", "haptic_client/app/options.hpp"))
        self.assertFalse(self.faults("server/cli/main.cpp", "server/rpc/services.hpp"))

    def test_contact_does_not_see_the_loop(self):
        self.assertTrue(self.faults("haptic_client/contact/proxy.cpp", "haptic_client/rendering/coupling.hpp"))
        self.assertTrue(self.faults("haptic_client/rendering/x.cpp", "haptic_client/simulation/surgeon.hpp"))
        self.assertFalse(self.faults("haptic_client/rendering/x.cpp", "haptic_client/contact/proxy.hpp"))
        self.assertTrue(self.faults("haptic_client/net/x.cpp", "haptic_client/rendering/coupling.hpp"))
        self.assertTrue(self.faults("haptic_client/new/x.cpp", "haptic_client/contact/proxy.hpp"))
        self.assertFalse(self.faults("haptic_client/app/client.cpp", "haptic_client/net/room_session.hpp"))

    def test_parts_of_sources_are_read_too(self):
        self.assertIn("server/rpc/called_room.inl", [relative(f) for f in tree.source_files(ROOT)])
        self.assertTrue(self.faults("server/publish/x.inl", "server/rooms/rooms.hpp"))

    def test_tests_of_no_folder_are_noticed(self):
        folders = {"server/rooms", "haptic_client", "haptic_client/contact"}
        self.assertTrue(tree.mirror_faults("tests/unit/net/x_test.cpp", folders))
        self.assertTrue(tree.mirror_faults("tests/unit/haptic_client/control/x_test.cpp", folders))
        self.assertFalse(tree.mirror_faults("tests/unit/rooms/x_test.cpp", folders))
        self.assertFalse(tree.mirror_faults("tests/unit/haptic_client/contact/x_test.cpp", folders))

    def test_lower_libraries_do_not_link_higher_ones(self):
        folders = tree.library_folders({
            "server/rooms/CMakeLists.txt": "osteon_library(server_rooms\n  SOURCES x.cpp)\n",
            "server/room/CMakeLists.txt": "osteon_library(room\n  DEPS osteon::core)\n",
            "viewer_client/net/CMakeLists.txt": "osteon_library(viewer_net)\n"})

        def faults(path, library):
            text = f"osteon_library(some\n  DEPS osteon::core\n  PRIVATE_DEPS osteon::{library})\n"
            return tree.link_faults(path, text, folders)
        self.assertTrue(faults("server/storage/CMakeLists.txt", "server_rooms"))
        self.assertTrue(faults("server/rpc/CMakeLists.txt", "viewer_net"))
        self.assertFalse(faults("server/storage/CMakeLists.txt", "room"))
        self.assertFalse(faults("server/rooms/CMakeLists.txt", "server_rooms"))

    def test_imaging_is_for_the_importer(self):
        self.assertTrue(self.faults("server/room/room.cpp", "common/imaging/dicom.hpp"))
        self.assertFalse(self.faults("server/import/main.cpp", "common/imaging/dicom.hpp"))

    def test_generated_types_stop_at_the_wire(self):
        self.assertTrue(self.faults("server/room/room.cpp", "osteon/v1/types.pb.h"))
        self.assertFalse(self.faults("server/rpc/x.cpp", "osteon/v1/room.grpc.pb.h"))

    def test_heavy_headers_stay_in_sources(self):
        self.assertTrue(self.faults("common/volume/case.hpp", "openvdb/openvdb.h"))
        self.assertTrue(self.faults("viewer_client/render/x.hpp", "vtkActor.h"))
        self.assertTrue(self.faults("server/room/room.cpp", "grpcpp/grpcpp.h"))
        self.assertTrue(self.faults("haptic_client/app/record_file.hpp", "hdf5.h"))
        self.assertTrue(self.faults("haptic_client/simulation/session.cpp", "hdf5.h"))
        self.assertFalse(self.faults("haptic_client/app/record_file.cpp", "hdf5.h"))
        self.assertFalse(self.faults("common/volume/case.cpp", "openvdb/openvdb.h"))

    def test_product_code_does_not_see_tests(self):
        self.assertTrue(self.faults("server/room/room.cpp", "tests/support/process.hpp"))

    def test_unchecked_locks_are_noticed(self):
        for line in ("  std::mutex mutex_;", "  const std::lock_guard lock(mutex_);", "std::shared_mutex& room_mutex",
                     "  std::condition_variable_any wake_;", "std::unique_lock<std::mutex>& lock"):
            self.assertTrue(tree.lock_faults("server/rooms/x.hpp", line + "\n"), line)
        self.assertFalse(tree.lock_faults("server/rooms/x.hpp", "  Mutex mutex_{LockRank::leaf};  // no std::mutex\n"))
        self.assertFalse(tree.lock_faults("common/core/mutex.hpp", "  std::mutex native_;\n"))
        self.assertFalse(tree.lock_faults("tests/unit/x_test.cpp", "  std::mutex mutex;\n"))

    def test_ranks_without_a_row_are_noticed(self):
        ranks = tree.lock_ranks("#define OSTEON_LOCK_RANKS(RANK) \\\n  RANK(room) \\\n  RANK(leaf)\n")
        self.assertEqual(ranks, ["room", "leaf"])
        self.assertEqual(tree.rank_rows("| rank | what |\n|---|---|\n| `room` | x |\n\n| `leaf` | y |\n"), ["room"])

    def test_sizes(self):
        self.assertTrue(tree.size_faults("common/core/x.hpp", "\n" * 300))
        self.assertFalse(tree.size_faults("common/core/x.hpp", "\n" * 299))
        self.assertTrue(tree.size_faults("common/core/x.cpp", "\n" * 800))

    def test_an_unlisted_file_is_noticed(self):
        self.assertTrue(tree.declaration_faults("common/core/check.hpp", "SOURCES precheck.hpp check.cpp"))
        self.assertFalse(tree.declaration_faults("common/core/check.hpp", "HEADERS check.hpp)"))
        first = '#include "server/cli/x.hpp"\n#include <vector>\n'
        self.assertFalse(tree.declaration_faults("server/cli/x.hpp", "", first))
        self.assertTrue(tree.declaration_faults("server/cli/x.hpp", "", "#include <vector>\n" + first))

    def test_a_suite_that_is_not_registered_is_noticed(self):
        self.assertFalse(tree.suite_faults("tests/unit/core/x_test.cpp", "TEST_P(Every,\n       Case) {"))
        self.assertTrue(tree.suite_faults("tests/unit/core/x.cpp", "TEST(Every, Case) {"))
        self.assertTrue(tree.suite_faults("tests/unit/core/x_test.cpp", "  TEST(Every, Case) {"))
        self.assertTrue(tree.suite_faults("tests/unit/core/x_test.cpp", "TYPED_TEST(Every, Case) {"))

    def test_a_source_that_is_not_listed_is_noticed(self):
        listed = "- **Chi 2005**: X. Chi, a paper.\n| RFC 8032 | signatures |\n"

        def faults(text):
            return references.reference_faults("x.hpp", text, listed)
        self.assertFalse(faults("// Chi et al. 2005, RFC 8032"))
        self.assertTrue(faults("// Chi et al. 2006"))
        self.assertTrue(faults("// as Yang and\n// Chen (2003) do"))
        self.assertTrue(faults("// RFC 9999"))
        self.assertTrue(faults("// as in §5.4"))
        self.assertFalse(faults("// Chi 2005, §2"))
        self.assertTrue(faults("// DESIGN section 5"))

    def test_a_program_that_no_package_has_is_noticed(self):
        found = packages.programs(["osteon_program(osteon-new\n  PACKAGE osteon\n  SOURCES main.cpp)\n"])
        self.assertEqual(found, {"osteon-new": "osteon"})
        complete = "usr/bin/osteon-new\nusr/share/man/man1/osteon-new*.1\n" \
                   "usr/share/bash-completion/completions/osteon-new\n"
        texts = ("complete -F _osteon osteon-new\n", "for program in osteon-new; do\n")
        self.assertFalse(packages.install_faults(found, {"osteon": complete}, *texts))
        for line in complete.splitlines():
            self.assertTrue(packages.install_faults(found, {"osteon": complete.replace(line, "x")}, *texts), line)
        self.assertTrue(packages.install_faults(found, {"osteon": complete}, texts[0], "for program in other; do\n"))
        self.assertTrue(packages.install_faults(packages.programs(["osteon_program(a SOURCES b.cpp)"]),
                                                {"osteon": complete}, *texts))
        self.assertEqual(packages.build_dependencies("Build-Depends:\n cmake (>= 3),\n libx-dev,\nX: y\n z\n"),
                         ["cmake", "libx-dev"])

    def test_style(self):
        wide = "x" * 121
        self.assertTrue(style.width_faults("a.cpp", wide))
        self.assertFalse(style.width_faults("a.cpp", "ö" * 120))
        self.assertFalse(style.width_faults("a.md", "| " + wide))
        self.assertTrue(style.cmake_faults("x/CMakeLists.txt", "  SOURCES a.cpp b.cpp"))
        self.assertFalse(style.cmake_faults("x/CMakeLists.txt", "  SOURCES a.cpp"))
        self.assertTrue(style.name_faults("a.cpp", "OldName old;", ["OldName"]))
        self.assertFalse(style.name_faults("a.cpp", "OldNames old;", ["OldName"]))
        table = "## Replaced names\n| `OldName`, `Older` | `New` |\n"
        self.assertEqual(style.retired_names(table), ["OldName", "Older"])

    def test_long_functions(self):
        body = "  f();\n" * 71
        self.assertEqual(style.long_functions("a.cpp", f"int a;\nvoid long_one(\n    int x) {{\n{body}}}\n"),
                         [("long_one", 71)])
        self.assertEqual(style.long_functions("a.cpp", f"namespace x {{\n{body}}}\n"), [])
        self.assertEqual(style.long_functions("a.cpp", f"X::X(int a)\n    : a_(a) {{\n{body}}}\n"), [("X::X", 71)])

    def test_subjects(self):
        for subject in ("reject cuts", "Rejected cuts", "Rejecting cuts", "Reject cuts.", "Reject; say", "R" * 73):
            self.assertTrue(style.subject_faults(subject), subject)
        for subject in ("Reject cuts after a freeze", "Bring the proxy back", "Feed the watchdog"):
            self.assertFalse(style.subject_faults(subject), subject)


if __name__ == "__main__":
    unittest.main(verbosity=2)
