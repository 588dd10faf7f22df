"""Checks that every source named by code or documents is in deploy/docs/references.md."""
import re
from pathlib import Path

FOLDERS = ("common", "server", "haptic_client", "viewer_client", "audio_client", "proto", "tests", "deploy")
ENDS = (".hpp", ".cpp", ".inl", ".h", ".md", ".py", ".proto", ".yaml", ".txt", ".cfg")
LIST = "deploy/docs/references.md"

NAME = r"(?:Mc)?[A-Z][a-zéöü]+"
# "Chi 2005", "Chi et al. (2005)", "Yang and Chen 2003", "Agus, Giachetti and Gobbetti (2002)".
CITATION = re.compile(rf"\b({NAME})(?:(?:, {NAME})*(?:,? and {NAME})| et al\.)?,? \(?((?:19|20)\d\d)\b(?![-.:]\d)")
STANDARD = re.compile(r"\b(RFC \d+|ISO \d+(?:-\d+)?|CVE-\d{4}-\d+)\b")
SECTION = re.compile(r"(.{0,11})§")


def reference_faults(path: str, text: str, listed: str):
    """One sentence for each source in `text` that the list `listed` lacks, and for each section without a source."""
    faults = []
    keys = set(re.findall(r"^- \*\*([^*]+)\*\*:", listed, re.MULTILINE))
    standards = set(STANDARD.findall(listed))
    joined = re.sub(r"\s*\n\s*(?://|#|\*)?\s*", " ", text)  # a citation may continue in the next line of a comment
    for name, year in CITATION.findall(joined):
        if f"{name} {year}" not in keys:
            faults.append(f"{path}: names {name} {year}, which {LIST} does not list")
    for standard in STANDARD.findall(joined):
        if standard not in standards:
            faults.append(f"{path}: names {standard}, which {LIST} does not list")
    for before in SECTION.findall(joined) if "§" in joined else ():  # the search takes long, and few files have one
        if not re.search(r"\d{4}, $", before):
            faults.append(f"{path}: a section without its source ('{before}§'); write 'Niu 2008, §7.2'")
    if re.search(r"\bDESIGN\b", joined):
        faults.append(f"{path}: refers to a document that is not in the project (DESIGN)")
    return sorted(set(faults))


def text_files(root: Path):
    files = [p for f in FOLDERS for p in (root / f).rglob("*") if p.suffix in ENDS or p.name == "CMakeLists.txt"]
    return sorted(p for p in [*files, root / "README.md"] if "stand_ins" not in p.parts)
