#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Each command line of fbvins in a document's code blocks is one that the program takes: its options are those of the command's help, their values are
accepted, and what it sets by `--set` is an option. None of them is run: they are given `--help` as well.

usage: document_commands.py FBVINS [REPOSITORY]      exit 1, and one line for each fault
"""
import pathlib
import re
import shlex
import subprocess
import sys

ENDS = {"|", "||", "&", "&&", ";", ">", ">>", "2>", "#"}
NESTED = {"map", "px4", "record"}  # commands of commands
SIMULATED = {"simulate"}  # whose --set is of the simulator's options


def blocks(text):
    """The lines of code blocks, those that end with a backslash joined to the next."""
    fenced, kept = False, ""
    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            kept += line.strip()
            if kept.endswith("\\"):
                kept = kept[:-1]
            else:
                yield kept
                kept = ""


def commands(line):
    """The arguments of each call of fbvins in a line of shell."""
    try:
        lexer = shlex.shlex(line, posix=True, punctuation_chars=";&|>")
        lexer.commenters, lexer.whitespace_split = "", True
        words = list(lexer)
    except ValueError:
        return
    previous = ""
    for at, word in enumerate(words):
        if previous == "#":
            return
        if (word == "fbvins" or word.endswith("/fbvins")) and (previous in ENDS | {"", "do"} or "=" in previous):
            end = next((i for i in range(at + 1, len(words)) if words[i] in ENDS), len(words))
            if end > at + 1:
                yield [re.sub(r"\$\w+", "1", word) for word in words[at + 1:end]]
        previous = word


def run(program, *arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60, check=False)


def faults_of(program, arguments, helps):
    # In a synopsis brackets hold what may be left out, and dots stand for more.
    arguments = [word.strip("[]") for word in arguments if word.strip("[]") not in {"...", ""}]
    name = tuple(arguments[:2 if arguments[0] in NESTED else 1])
    if name not in helps:
        done = run(program, *name, "--help")
        helps[name] = done.stdout if done.returncode == 0 else None
    if helps[name] is None:
        yield f"there is no command '{' '.join(name)}'"
        return
    known = set(re.findall(r"(?<![\w-])--?[a-z][a-z0-9-]*", helps[name]))
    for word in arguments:
        option = word.split("=")[0]
        if re.fullmatch(r"--?[a-z][a-z0-9-]*", option) and option not in known:
            yield f"'{' '.join(name)}' has no option {option}"
    if "--plugin" in arguments:  # a file that is not here, and a name that it brings along
        arguments = [word for before, word in zip([""] + arguments, arguments) if not {before, word} & {"--plugin", "--frontend"}]
    said = run(program, *arguments, "--help").stderr.splitlines()
    if said:
        yield said[0]
    if not SIMULATED & set(name):
        for before, value in zip(arguments, arguments[1:]):
            said = run(program, "config", "--set", value) if before == "--set" else None
            if said and said.returncode != 0:
                yield said.stderr.strip()


def main():
    program, root = sys.argv[1], pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else ".").resolve()
    helps, count, found = {}, 0, []
    for page in sorted([*root.glob("*.md"), *root.glob("docs/**/*.md"), *root.glob("training/*.md")]):
        if page.name == "CHANGELOG.md":
            continue
        for line in blocks(page.read_text(encoding="utf-8")):
            for arguments in commands(line):
                count += 1
                found += [f"{page.relative_to(root)}: fbvins {' '.join(arguments)}: {fault}" for fault in faults_of(program, arguments, helps)]
    print("\n".join(dict.fromkeys(found)) or f"documents: {count} commands of fbvins are taken by the program")
    return 1 if found or count < 80 else 0


if __name__ == "__main__":
    sys.exit(main())
