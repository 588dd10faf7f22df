"""Rules for the Debian packages of deploy/debian: each program is in one of them, with its man pages and completion."""
import re

PROGRAM = re.compile(r"^osteon_program\(\s*([\w-]+)(?:\s+PACKAGE\s+([\w-]+))?", re.MULTILINE)


def pages(name):
    """The man pages of a program and its commands. The window's name begins the names of all others."""
    return name if name == "osteon" else f"{name}*"


def programs(cmake_texts):
    """Name of each program -> its package, or "" where it names none."""
    return dict(found for text in cmake_texts for found in PROGRAM.findall(text))


def packages(control: str):
    return re.findall(r"^Package: (\S+)$", control, re.MULTILINE)


def build_dependencies(control: str):
    """The names in Build-Depends, one in a line, without versions."""
    field = control.partition("Build-Depends:\n")[2]
    return re.findall(r"^ ([\w+.-]+)", re.split(r"^\S", field, maxsplit=1, flags=re.MULTILINE)[0], re.MULTILINE)


def listed_packages(text: str):
    return set(re.sub(r"#.*", "", text).split())


def install_faults(found, lists, completion: str, man: str):
    """One sentence for each thing of a program that no package has. `found`: name -> package. `lists`: package -> text
    of its .install file. `completion` and `man`: deploy/completion.bash and deploy/man."""
    faults = []
    for name, package in sorted(found.items()):
        if package not in lists:
            faults.append(f"{name}: its package '{package}' has no deploy/debian/{package or 'PACKAGE'}.install")
            continue
        lines = lists[package].splitlines()
        for line in (f"usr/bin/{name}", f"usr/share/man/man1/{pages(name)}.1",
                     f"usr/share/bash-completion/completions/{name}"):
            if line not in lines:
                faults.append(f"deploy/debian/{package}.install: misses {line}")
        for file, text in (("deploy/completion.bash", completion), ("deploy/man", man)):
            if not re.search(rf"^(complete |for program in ).*\b{name}\b", text, re.MULTILINE):
                faults.append(f"{file}: misses {name}")
    return faults
