"""Prints the components of Debian packages as CycloneDX 1.5: the packages, and those that they need to run.

components.py FILE.deb...   The needed ones are those that apt would install on an empty Debian, without recommended
packages, by the lists of this machine. SOURCE_DATE_EPOCH is the time in the result. The same input gives the same
bytes.
"""
import datetime
import hashlib
import json
import os
import re
import subprocess
import sys
import uuid
from pathlib import Path
from urllib.parse import quote


def said(*command):
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"components.py: {command[0]}: {(done.stderr.strip() or 'failed').splitlines()[-1]}")
    return done.stdout


def fields(text):
    """A paragraph of a control file, without the long lines of its description."""
    return dict(line.split(": ", 1) for line in text.splitlines() if ": " in line and not line.startswith(" "))


def purl(name, version, architecture, namespace):
    """A package URL; characters beyond the unreserved ones are escaped."""
    return f"pkg:deb/{namespace}/{quote(name, safe='')}@{quote(version, safe='')}?arch={architecture}"


def own_component(file: Path):
    about = fields(said("dpkg-deb", "--field", str(file)))
    reference = purl(about["Package"], about["Version"], about["Architecture"], "osteon")
    return about, {
        "type": "application",
        "bom-ref": reference,
        "name": about["Package"],
        "version": about["Version"],
        "description": about["Description"],
        "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(file.read_bytes()).hexdigest()}],
        "licenses": [{"license": {"id": "Apache-2.0"}}],
        "purl": reference,
    }


def needed(files):
    """Name -> (version, architecture) of all that apt would install beside the files."""
    plan = said("apt-get", "-s", "-q", "-o", "Dir::State::status=/dev/null", "-o", "Debug::NoLocking=1",
                "--no-install-recommends", "install", *map(str, files))
    # Inst NAME (VERSION ORIGIN [ARCHITECTURE])
    return {name: (version, architecture) for name, version, architecture
            in re.findall(r"^Inst (\S+) \((\S+) .*\[(\w+)\]\)", plan, re.M)}


def provided(packages):
    """Name of each virtual package -> the one of `packages`, as by needed(), that provides it."""
    text = said("apt-cache", "show", *(f"{name}={version}" for name, (version, _) in sorted(packages.items())))
    return {re.sub(r"[:\s(].*", "", name.strip()): about["Package"]
            for about in map(fields, text.split("\n\n")) if "Provides" in about
            for name in about["Provides"].split(",")}


def depends(about, known):
    """The references of its dependencies: of alternatives, the first that is there."""
    found = set()
    for alternatives in f"{about.get('Pre-Depends', '')},{about.get('Depends', '')}".split(","):
        names = [re.sub(r"[:\s(].*", "", name.strip()) for name in alternatives.split("|")]
        found.update([known[name] for name in names if name in known][:1])
    return sorted(found)


def main():
    files = sorted((Path(name).resolve() for name in sys.argv[1:] if "-dbgsym_" not in name), key=lambda f: f.name)
    if not files:
        sys.exit("components.py: give the files of the packages")
    own = [own_component(file) for file in files]
    foreign = needed(files)
    for about, _ in own:
        foreign.pop(about["Package"], None)
    others = []
    for name, (version, architecture) in sorted(foreign.items()):
        reference = purl(name, version, architecture, "debian")
        others.append({"type": "library", "bom-ref": reference, "name": name, "version": version, "purl": reference})
    known = {component["name"]: component["bom-ref"] for component in [*(c for _, c in own), *others]}
    known = {virtual: known[name] for virtual, name in provided(foreign).items()} | known
    date = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), datetime.timezone.utc)
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "timestamp": date.strftime("%Y-%m-%dT%H:%M:%SZ"),
            "component": {"type": "application", "bom-ref": "osteon", "name": "osteon",
                          "version": own[0][0]["Version"]},
        },
        "components": [component for _, component in own] + others,
        "dependencies": [{"ref": "osteon", "dependsOn": [component["bom-ref"] for _, component in own]}] +
                        [{"ref": component["bom-ref"], "dependsOn": depends(about, known)} for about, component in own],
    }
    digest = hashlib.sha256(json.dumps(bill, sort_keys=True).encode()).digest()
    bill["serialNumber"] = f"urn:uuid:{uuid.UUID(bytes=digest[:16], version=5)}"
    print(json.dumps(bill, indent=2, ensure_ascii=False))


if __name__ == "__main__":
    main()
