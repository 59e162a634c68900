#!/usr/bin/env python3
"""Says which figures of docs/results/ are older than the code that they speak of, and reads the pages for deploy/results.

A paragraph below each table names the commit that was measured and the folders that the figures depend on:
"Measured: COMMIT, DATE, SEED, MACHINE, N CPU s, of `FOLDER/`, `FOLDER/`: COMMAND". N is the processor's time that its
commands took, where it was recorded. The paragraph ends with "By hand: REASON." where the commands do not make the
figures, and with "Compared by the tests." where a test makes them anew. Figures are older where git knows later commits
that changed more than comments in these folders; of a range of commits the first counts. How often the bits of the
recorded runs have changed since tells what such changes may be worth. What a test makes anew is not older. Without the
repository's history nothing is said.
Usage: docs/site/older.py [PAGE...]
"""

import functools
import glob
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
MEASURED = re.compile(r"^Measured: (\w{7})(?: to \w{7})?, (?:.+\n)*?.*?\bof\s+((?:`[\w/]+/`,?\s*)+):(.*(?:\n.+)*)", re.M)
CELL = re.compile(r"(?<!\\)\|")  # what parts the cells of a table's line
PROGRAM = re.compile(r"(?:[A-Z_]+=\S+ )*(?:poise|perf|git|node \S+|deploy/\S+|(?:build|tests)/\w+/\S+(?<!\.cc))(?: |$)")
COMPARED = "Compared by the tests."
BITS = "deploy/bits/*.bytes"  # a file for each recorded run
CODE = r"^[[:space:]]*[^/#[:space:]]"  # a line that is more than a comment


def git(root, *words):
    """Lines that git prints; none where there is no git, no history, or no such commit."""
    try:
        return subprocess.run(["git", "-C", root, *words], capture_output=True, text=True, check=False).stdout.splitlines()
    except FileNotFoundError:
        return []


@functools.cache
def history(root):
    """All commits, the newest first: {hash: ("HASH, DATE", files of which it changed more than comments)}."""
    commits = {}
    for line in git(root, "log", "-G", CODE, "--name-only", "--format=%x00%H %h, %cs"):
        if line.startswith("\0"):
            commit, name = line[1:].split(" ", 1)
            commits[commit] = (name, [])
        elif line:
            commits[commit][1].append(line)
    return commits


@functools.cache
def since(commit, root):
    """Hashes of the commits after this one, and how many of them changed the bits of recorded runs."""
    hashes = git(root, "rev-list", f"{commit}..HEAD")
    return set(hashes), len(git(root, "rev-list", f"{commit}..HEAD", "--", BITS)) if hashes else 0


def later(commit, folders, root=ROOT):
    """What has changed the folders since, in words; "": nothing has, or git does not know."""
    after, bits = since(commit, root)
    found = [name for hash_, (name, files) in history(root).items()
             if hash_ in after and any(file.startswith(tuple(folders)) for file in files)] if after else []
    if not found:
        return ""
    count = "one commit has" if len(found) == 1 else f"{len(found)} commits have"
    times = {0: "have not changed", 1: "have changed once"}.get(bits, f"have changed {bits} times")
    return f"{count} changed it since, the last {found[0]}; the bits of recorded runs {times}"


def tables(markdown, root=ROOT):
    """Each paragraph "Measured:" whose code has changed since: (match, what has changed it)."""
    for match in MEASURED.finditer(markdown):
        if COMPARED in " ".join(match[0].split()):
            continue
        changes = later(match[1], re.findall(r"`([^`]+)`", match[2]), root)
        if changes:
            yield match, changes


class Claim:
    """A table of a page: its heading, cells, and the commands that its paragraph "Measured:" tells."""

    def __init__(self, page, lines, end, match):
        """lines: of the page; end: the number of the paragraph's first line, right below the table."""
        begin = end
        while lines[begin - 1].startswith("|"):
            begin -= 1
        top = max(i for i in range(begin) if lines[i].startswith("#"))
        self.heading = lines[top].lstrip("# ")
        slug = re.sub(r"[^\w\- ]", "", self.heading.lower()).replace(" ", "-")  # GitHub's anchor
        self.page, self.name = page, f"{os.path.basename(page)[:-3]}#{slug}"
        self.header, *self.rows = [self.cells(line) for line in lines[begin:end] if not re.fullmatch(r"[|:\- ]+", line)]
        self.first_row = begin + 2  # the number of its line, from 0
        self.measured, self.commit = match[0], match[1]
        self.machine = "any machine" if "any machine" in " ".join(match[0].split()) else "2 cores"
        took = re.search(r"\b(\d+) CPU s,\s+of\s", match[0])
        self.seconds = int(took[1]) if took else None
        self.text, _, reason = " ".join(match[3].split()).partition(" By hand: ")
        self.by_hand = reason.rstrip(".")  # why its figures are not made by its commands
        self.told = commands_of(self.text)
        if not self.told and re.search(r"commands? (?:above|below)", self.text):
            self.told = fenced(lines[top:begin])[-1:] or fenced(lines[end:])[:1]

    @staticmethod
    def cells(line):
        return [cell.strip().replace("\\|", "|") for cell in CELL.split(line.strip())[1:-1]]

    def commands(self):
        """Those of the paragraph, then those of the rows."""
        rows = [command for row in self.rows for cell in row for command in commands_of(cell)]
        return list(dict.fromkeys(self.told + rows))


def commands_of(text):
    return [span for span in re.findall(r"`([^`]+)`", text) if PROGRAM.match(span)]


def fenced(lines):
    """The commands of indented blocks; one that ends with \\ goes on."""
    text = "\n".join(line[4:] for line in lines if line.startswith("    "))
    return [" ".join(c.split()) for c in text.replace("\\\n", " ").splitlines() if PROGRAM.match(c)]


def claims(page):
    """The tables of a page of docs/results that say how they were measured, in their order."""
    with open(page, encoding="utf-8") as file:
        text = file.read()
    lines, found = text.split("\n"), []
    for match in MEASURED.finditer(text):
        line = text.count("\n", 0, match.start())
        line -= lines[line - 1] == ""  # the paragraph stands below the table, with a line between them
        found.append(Claim(page, lines, line, match))
    for claim in found:  # "the commands above" of another table
        if not claim.told and re.search(r"commands? above", claim.text):
            claim.told = found[found.index(claim) - 1].told
    return found


def marked(markdown, root=ROOT):
    """The page with a remark below each such paragraph."""
    for match, changes in reversed(list(tables(markdown, root))):
        remark = f"\n\n**Older than the code**: {changes}."
        markdown = markdown[:match.end()] + remark + markdown[match.end():]
    return markdown


if __name__ == "__main__":
    for page in sys.argv[1:] or sorted(glob.glob(f"{ROOT}/docs/results/*.md")):
        with open(page, encoding="utf-8") as file:
            text = file.read()
        for found, changes in tables(text):
            line = text.count("\n", 0, found.start()) + 1
            print(f"{os.path.relpath(page, ROOT)}:{line}: older than the code: {changes}")
