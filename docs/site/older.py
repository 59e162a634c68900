#!/usr/bin/env python3
"""Says which figures of docs/results/ are older than the code that they speak of.

A paragraph below each table names the commit that was measured and the folders that the figures depend on:
"Measured: COMMIT, DATE, SEED, MACHINE, of `FOLDER/`, `FOLDER/`: COMMAND". They are older where git knows a later commit
that changed more than comments there; of a range of commits the first counts. Without the repository's history nothing is said.
Usage: docs/site/older.py [PAGE...]
"""

import glob
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
MEASURED = re.compile(r"^Measured: (\w{7})(?: to \w{7})?, (?:.+\n)*?.*?\bof\s+((?:`[\w/]+/`,?\s*)+):.*(?:\n.+)*", re.M)
CODE = r"^[[:space:]]*[^/#[:space:]]"  # a line that is more than a comment


def later(commit, folders, root=ROOT):
    """The last commit after `commit` that changed more than comments of the folders, as "HASH, DATE"; "": none, or git does not know."""
    command = ["git", "-C", root, "log", "-1", "-G", CODE, "--format=%h, %cs", f"{commit}..HEAD", "--", *folders]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
    except FileNotFoundError:  # no git
        return ""


def tables(markdown, root=ROOT):
    """Each paragraph "Measured:" whose code has changed since: (match, later commit)."""
    for match in MEASURED.finditer(markdown):
        commit = later(match[1], re.findall(r"`([^`]+)`", match[2]), root)
        if commit:
            yield match, commit


def marked(markdown, root=ROOT):
    """The page with a remark below each such paragraph."""
    for match, commit in reversed(list(tables(markdown, root))):
        remark = f"\n\n**Older than the code**, which commit {commit}, has changed since."
        markdown = markdown[:match.end()] + remark + markdown[match.end():]
    return markdown


if __name__ == "__main__":
    for page in sys.argv[1:] or sorted(glob.glob(f"{ROOT}/docs/results/*.md")):
        with open(page, encoding="utf-8") as file:
            text = file.read()
        for found, commit in tables(text):
            line = text.count("\n", 0, found.start()) + 1
            print(f"{os.path.relpath(page, ROOT)}:{line}: older than the code, which commit {commit}, has changed")
