"""The rules for source files: which folders may include which, which headers are heavy, and how long files are."""
import re
from pathlib import Path

# Folder of common/ -> the other folders of common/ that it may include.
LAYERS = {
    "core": set(),
    "geometry": {"core"},
    "tools": {"core", "geometry"},
    "field": {"core", "geometry", "tools"},
    "volume": {"core", "geometry", "tools", "field"},
    "imaging": {"core", "geometry", "tools", "field", "volume"},
    "phantoms": {"core", "geometry", "tools", "field", "volume"},
    "radiology": {"core", "geometry", "tools", "field", "volume"},
    "surface": {"core", "geometry", "tools", "field"},
    "mechanics": {"core", "geometry", "tools", "field"},
    "picture": {"core"},
    "recording": {"core"},
    "sound": {"core"},
    "runtime": {"core"},
    "subvolumes": {"core", "geometry", "tools", "field", "volume", "surface", "runtime"},
    "access": {"core"},
    "link": {"core", "geometry"},
    "input": {"core", "geometry", "runtime"},
    "wire": {"core", "geometry", "tools", "field", "surface", "mechanics", "access", "link"},
}
PROGRAMS = ("server", "haptic_client", "viewer_client", "audio_client")
# Folder of server/ -> the other folders of server/ that it may include. Requests go from rpc down to room.
SERVER_LAYERS = {
    "room": set(),
    "journal": set(),
    "upload_validation": set(),
    "import": {"upload_validation"},
    "audit": {"journal"},
    "auth": {"audit"},
    "publish": {"journal", "room"},
    "storage": {"journal", "room"},
    "rooms": {"room", "journal", "upload_validation", "audit", "auth", "publish", "storage"},
    "rpc": {"room", "journal", "upload_validation", "audit", "auth", "publish", "storage", "rooms"},
    "cli": {"room", "journal", "upload_validation", "audit", "auth", "publish", "storage", "rooms", "rpc"},
}
# The same for haptic_client/. The tool's motion goes from simulation or a device down to contact.
HAPTIC_LAYERS = {
    "net": set(),
    "device": set(),
    "contact": set(),
    "prediction": {"contact"},
    "rendering": {"device", "contact", "prediction"},
    "simulation": {"device", "contact", "prediction", "rendering"},
    "app": {"net", "device", "contact", "prediction", "rendering", "simulation"},
}
# Inside a client: which folders (and tests) may include this one.
OUTER = {"app": set(), "desktop": set(), "inside": {"desktop"}, "net": {"app", "desktop", "inside"}}

# Headers that are slow to compile or impose a library's conventions. They must stay out of headers, and within the
# folders named here.
HEAVY = {
    "OpenVDB": (re.compile(r"^openvdb/"), ("common/volume",)),
    "VTK": (re.compile(r"^vtk"), ("viewer_client", "common/volume")),
    "gRPC": (re.compile(r"^grpc(pp)?/"), ("common/wire", "*/net", "server/rpc", "server/auth", "server/cli")),
    "HDF5": (re.compile(r"^hdf5"), ("common/recording", "haptic_client/app")),
    "SQLite": (re.compile(r"^sqlite3"), ("server/journal",)),
    "Asio": (re.compile(r"^asio"), ("common/link",)),
    "Prometheus": (re.compile(r"^prometheus/"), ("server/rpc",)),
    "libusb": (re.compile(r"^libusb"), ("haptic_client/device",)),
    "hidapi": (re.compile(r"^hidapi/"), ("common/input",)),
    "SDL": (re.compile(r"^(SDL2/)?SDL"), ("viewer_client/pad",)),
    "GDCM": (re.compile(r"^gdcm"), ("common/imaging", "server/import")),
}
GENERATED = re.compile(r"\.pb\.h$")
GENERATED_HOMES = ("common/wire", "*/net", "server/rpc", "server/publish", "server/storage", "server/cli")

# Locks that clang does not check. Programs use those of common/core/mutex.hpp.
UNCHECKED_LOCK = re.compile(
    r"std::((recursive_|timed_|recursive_timed_|shared_|shared_timed_)?mutex|condition_variable(_any)?"
    r"|lock_guard|unique_lock|scoped_lock|shared_lock)\b")
LOCKS = "common/core/mutex.hpp"
LOCK_RANKS = "common/core/lock_rank.hpp"

SOURCE_ENDS = (".hpp", ".cpp", ".inl", ".h", ".cc")
MAX_HEADER_LINES = 300
MAX_FILE_LINES = 800

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)
TARGET = re.compile(r"^osteon_(?:library|program)\(\s*([\w-]+)([^)]*)\)", re.MULTILINE)


def source_files(root: Path):
    folders = ("common", *PROGRAMS, "tests")
    return sorted(p for f in folders for p in (root / f).rglob("*") if p.suffix in SOURCE_ENDS)


def includes(text: str):
    return INCLUDE.findall(text)


def lives_in(path: str, homes) -> bool:
    parts = path.split("/")
    for home in homes:
        wanted = home.split("/")
        if len(parts) > len(wanted) and all(w in ("*", p) for w, p in zip(wanted, parts)):
            return True
    return False


def layer_faults(path: str, text: str):
    """One sentence for each include of `path` (relative to the root, '/'-separated) that the layers forbid."""
    parts = path.split("/")
    if parts[0] == "tests":
        return []
    faults = []
    for include in includes(text):
        target = include.split("/")
        if target[0] == "tests":
            faults.append(f"{path}: includes {include}, but only tests include tests")
        elif target[0] == "common" and len(target) > 2:
            if parts[0] == "common" and target[1] != parts[1] and target[1] not in LAYERS.get(parts[1], set()):
                faults.append(f"{path}: common/{parts[1]} must not include {include}")
            if target[1] == "imaging" and parts[:2] not in (["common", "imaging"], ["server", "import"]):
                faults.append(f"{path}: only server/import uses common/imaging, not this file ({include})")
        elif target[0] in PROGRAMS:
            if parts[0] != target[0]:
                faults.append(f"{path}: belongs to {parts[0]} and must not include {include}")
            elif target[0] == "server":
                if target[1] != parts[1] and target[1] not in SERVER_LAYERS.get(parts[1], set()):
                    faults.append(f"{path}: server/{parts[1]} must not include {include}")
            elif target[0] == "haptic_client":
                if target[1] != parts[1] and target[1] not in HAPTIC_LAYERS.get(parts[1], set()):
                    faults.append(f"{path}: haptic_client/{parts[1]} must not include {include}")
            elif len(target) > 2 and target[1] != parts[1] and target[1] in OUTER and parts[1] not in OUTER[target[1]]:
                faults.append(f"{path}: only {', '.join(sorted(OUTER[target[1]])) or 'tests'} may include {include}")
        if GENERATED.search(include) and not lives_in(path, GENERATED_HOMES):
            faults.append(f"{path}: generated code ({include}) belongs to {', '.join(GENERATED_HOMES)}")
        for name, (pattern, homes) in HEAVY.items():
            if not pattern.search(include):
                continue
            if path.endswith((".hpp", ".h")):
                faults.append(f"{path}: {name} belongs in .cpp files only ({include})")
            elif not lives_in(path, homes):
                faults.append(f"{path}: {name} is used in {', '.join(homes)} only ({include})")
    if parts[0] == "common" and len(parts) > 2 and parts[1] not in LAYERS:
        faults.append(f"{path}: common/{parts[1]} is not a layer of the design")
    return faults


def library_folders(cmake_texts):
    """Name of each library -> its folder. `cmake_texts`: path -> text of the CMakeLists.txt files."""
    return {name: path.rsplit("/", 1)[0] for path, text in cmake_texts.items() for name, _ in TARGET.findall(text)}


def link_faults(path: str, text: str, folders):
    """The layers again, for what the targets of a CMakeLists.txt link: a static library may be part of a circle, and
    CMake does not complain."""
    faults = []
    folder = path.rsplit("/", 1)[0]
    for name, body in TARGET.findall(text):
        for library in re.findall(r"osteon::(\w+)", body):
            home = folders.get(library, "")
            if home != folder and layer_faults(path, f'#include "{home}/{library}.hpp"\n'):
                faults.append(f"{path}: {name} must not link osteon::{library} of {home}")
    return faults


def mirror_faults(path: str, folders):
    """Unit tests of a folder are in the folder of the same name. `folders`: those of the programs and libraries."""
    if not path.startswith("tests/unit/"):
        return []
    mirrored = "/".join(path.split("/")[2:-1])
    if any(home + mirrored in folders for home in ("", "common/", "server/")):
        return []
    return [f"{path}: there is no folder {mirrored} that it could test"]


def lock_faults(path: str, text: str):
    """One sentence for each line of a program that uses a lock which clang does not check."""
    if path.startswith("tests/") or path == LOCKS:
        return []
    return [f"{path}:{number}: {found[0]} is not checked by clang; use {LOCKS}"
            for number, line in enumerate(text.splitlines(), 1)
            if (found := UNCHECKED_LOCK.search(line.partition("//")[0]))]


def lock_ranks(text: str):
    """The ranks of LOCK_RANKS, in their order."""
    return re.findall(r"\bRANK\((\w+)\)", text.partition("OSTEON_LOCK_RANKS(RANK)")[2])


def rank_rows(page: str):
    """The first column of the table of ranks in the page about the architecture."""
    table = page.partition("| rank |")[2].partition("\n\n")[0]
    return re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)


def size_faults(path: str, text: str):
    lines = text.count("\n")
    if path.endswith((".hpp", ".h")) and lines >= MAX_HEADER_LINES:
        return [f"{path}: {lines} lines; a header is a page, below {MAX_HEADER_LINES}"]
    if lines >= MAX_FILE_LINES:
        return [f"{path}: {lines} lines; below {MAX_FILE_LINES}, usually it is two things in one"]
    return []


def declaration_faults(path: str, cmake_text: str, source_text=None):
    """A source that no target lists is never built. A header that no target lists is not compiled alone by
    deploy/nightly, unless its own source (`source_text`) includes it first."""
    name = path.rsplit("/", 1)[-1]
    if path.startswith("tests/unit/") and name.endswith(".hpp"):
        return []  # a helper of the only test program beside it
    if name.endswith(".inl"):
        return []  # a part of the sources that include it
    if re.search(rf"(?<![\w/.-]){re.escape(name)}(?![\w.-])", cmake_text):
        return []
    if name.endswith(".hpp") and source_text is not None and includes(source_text)[:1] == [path]:
        return []
    return [f"{path}: not listed in the CMakeLists.txt of its folder" +
            (", nor the first include of its source" if name.endswith(".hpp") else "")]


def suite_faults(path: str, text: str):
    """osteon_test() registers the suites that begin a line of a file NAME_test.cpp. ctest would not run others."""
    if not path.startswith("tests/"):
        return []
    found = re.findall(r"^(.*?)\b((?:TYPED_)?TEST(?:_F|_P)?)\(", text, re.M)
    return [f"{path}: {before}{macro}(: ctest does not run it; begin a line of a file *_test.cpp with TEST, TEST_F or "
            "TEST_P" for before, macro in found
            if before or macro.startswith("TYPED") or not path.endswith("_test.cpp")]
