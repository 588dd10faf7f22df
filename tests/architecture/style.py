"""Rules of style that a program can check: widths, replaced names, CMake lists, lengths, subjects of commits."""
import re
import subprocess
from pathlib import Path

WIDEST = 120          # columns
LONGEST_FUNCTION = 70  # lines
LONGEST_SUBJECT = 72  # characters
SINCE = "c2cd851a7372"  # subjects of commits after this one
GLOSSARY = "deploy/docs/glossary.md"
MAY_NAME_THEM = (GLOSSARY, "tests/architecture/tree_test.py")
LONG_FUNCTIONS = "tests/architecture/long_functions.txt"
# Files without text written by people.
NO_TEXT = {".jpg", ".png", ".journal", ".bin", ".zip", ".gz", ".vdb", ".dcm", ".stl"}
NO_FUNCTION = r"(namespace|class|struct|enum|union|extern|if|for|while|switch|do|else|try|return|case)\b"
SOURCE_FILE = re.compile(r"[\w./${}-]+\.(?:cpp|hpp|inl)\b")


def tracked_files(root: Path):
    listed = subprocess.run(["git", "-C", str(root), "ls-files", "-z"], capture_output=True, text=True,
                            check=True).stdout
    return [root / name for name in listed.split("\0") if name and Path(name).suffix not in NO_TEXT]


def width_faults(path: str, text: str):
    """Lines that are too wide. Rows of Markdown tables, addresses and directives of HAProxy 2.6 cannot be broken."""
    return [f"{path}:{number}: {len(line)} columns" for number, line in enumerate(text.splitlines(), 1)
            if len(line) > WIDEST and not (path.endswith(".md") and line.lstrip().startswith("|"))
            and not (path.endswith("haproxy.cfg") and line.lstrip()[0] != "#") and "https://" not in line]


def cmake_faults(path: str, text: str):
    if not path.endswith(("CMakeLists.txt", ".cmake")):
        return []
    return [f"{path}:{number}: more than one source file on a line" for number, line in enumerate(text.splitlines(), 1)
            if not line.lstrip().startswith("#") and len(SOURCE_FILE.findall(line)) > 1]


def retired_names(glossary: str):
    """The names in code quotes of the first column of the table "Replaced names"."""
    table = glossary.partition("## Replaced names")[2]
    return [name for line in table.splitlines() if line.startswith("| ")
            for name in re.findall(r"`([^`]+)`", line.split("|")[1])]


def name_faults(path: str, text: str, retired):
    pattern = re.compile(r"(?<![\w-])(" + "|".join(map(re.escape, retired)) + r")(?![\w-])")
    return [f"{path}:{number}: {found[1]} is a replaced name; see {GLOSSARY}"
            for number, line in enumerate(text.splitlines(), 1) for found in pattern.finditer(line)]


def long_functions(path: str, text: str):
    """(name, lines) of each function in formatted C++. A body ends at the indent at which it began."""
    if not path.endswith((".cpp", ".hpp", ".inl")):
        return []
    lines, found = text.splitlines(), []
    for number, line in enumerate(lines):
        if not line.endswith("{"):
            continue
        # The declaration begins after the end of the code before it.
        begin = number
        while begin > 0 and lines[begin - 1].strip() and not re.search(r"([;{}:]|^\s*(//|#).*)$", lines[begin - 1]):
            begin -= 1
        head = " ".join(part.strip() for part in lines[begin:number + 1])
        name = re.match(r"(?:template <.*?> )?(?:[\w:<>,*&\[\] ]+ )?[*&]?([\w:~]+|operator\S+)\(", head)
        if not name or re.match(NO_FUNCTION, head) or re.search(r"[=,(]\s*\[[^\]]*\]\s*[({]", head):
            continue
        indent = len(lines[begin]) - len(lines[begin].lstrip())
        end = next((i for i in range(number + 1, len(lines)) if re.match(rf" {{{indent}}}}}[;,)]*$", lines[i])), None)
        if end is not None and end - number - 1 > LONGEST_FUNCTION:
            found.append((name[1], end - number - 1))
    return found


def subject_faults(subject: str):
    """A subject is an imperative: "Reject cuts after a freeze"."""
    faults = []
    if len(subject) > LONGEST_SUBJECT:
        faults.append(f"{len(subject)} characters")
    if subject.endswith(".") or ";" in subject:
        faults.append("more than one sentence, or a full stop")
    if re.match(r"[a-z]|\w+(ed|ing)\b(?<!\bNeed)(?<!\bBring)(?<!\bFeed)(?<!\bEmbed)(?<!\bShed)", subject):
        faults.append("no imperative at its beginning")
    return [f"\"{subject}\": {fault}" for fault in faults]
