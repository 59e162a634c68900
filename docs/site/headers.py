#!/usr/bin/env python3
"""Writes the site's C++ reference into FOLDER: a page a folder, a heading a type or free function."""

import functools
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("components", "sim", "sim_ode", "sim_mujoco", "hw_bridge", "logging", "tools")
MARKUP = re.compile(r"([\\*_{}\[\]<>#|$])")  # what a comment means as it stands, beside its spans of code
PRIVATE = re.compile(r"\n+ private:\n.*?(?=\n(?: public:| protected:|\};))", re.S)


def declarations(lines):
    """Each declaration of a namespace: (lines of the `///` comment above it, its text)."""
    comment, text, depth = [], "", 0
    for line in lines:
        if not text and (line == "" or re.match(r"namespace|\}|//(?!/)|#(?!define)", line)):
            comment = []
        elif not text and line.startswith("///"):
            comment.append(line[4:])
        else:
            text += line + "\n"
            code = re.sub(r'"(\\.|[^"\\])*"|\'(\\.|[^\'\\])\'|//.*', "", line).rstrip()
            depth += len(re.findall(r"[({]", code)) - len(re.findall(r"[)}]", code))
            if not line.endswith("\\") and (text.startswith("#") or depth == 0 and code[-1:] in (";", "}")):
                yield comment, text.rstrip()
                comment, text, depth = [], "", 0


def name_of(text):
    """The type, function or macro that a declaration makes known; "": a constant or an alias; None: nothing new."""
    head = text.replace("decltype(auto)", "auto")
    while head != (head := re.sub(r"<[^<>]*>", "", head)):
        pass
    kind = re.match(r"(?:template\s+)?(?:class|struct|enum(?: class)?)\s+(\w+)", head)
    if re.match(r"using [\w:]+;|extern |template class|static_assert", head) or kind and "{" not in head:
        return None
    known = kind or re.match(r"#define (\w+)|(?!using )[^=]*?\b(operator\W+?|\w+)\(", head)
    return next(name for name in known.groups() if name) if known else ""


def prose(lines):
    parts = re.split(r"(`[^`]*`)", "\n".join(lines))
    return "".join(part if part.startswith("`") else MARKUP.sub(r"\\\1", part) for part in parts).strip()


@functools.cache
def reference():
    """({page: Markdown}, {header: (page, anchor, {name: anchor})}), with anchors as mkdocs gives them."""
    pages, headers, anchors = {}, {}, {}
    for path in sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.h")):
        folder = str(path.parent.relative_to(ROOT)).removeprefix("components/")
        page = folder.replace("/", "_") + ".md"
        text = pages.setdefault(page, [])

        def heading(level, title):
            slug = re.sub(r"[^\w-]", "", title.lower())
            count = anchors[page, slug] = anchors.get((page, slug), -1) + 1
            text.append(f"{level} {title}")
            return f"{slug}_{count}" if count else slug

        if not text:
            heading("#", folder)
        about, lines = re.match(r"((?://.*\n)*)([\s\S]*)", path.read_text("utf-8")).groups()
        found = {"": []}  # what has no heading of its own stands first
        for comment, code in declarations(lines.split("\n")):
            found.setdefault(name_of(code), []).extend([prose(comment), f"```cpp\n{re.sub(r'///<?', '//', PRIVATE.sub('', code))}\n```"])
        headers[str(path.relative_to(ROOT))] = (page, heading("##", f"`{path.name}`"), names := {})
        text += [prose(line[3:] for line in about.split("\n")), *found.pop("")]
        for name in filter(None, found):
            names[name] = heading("###", name.replace("_", r"\_"))
            text += found[name]
    return {page: "\n\n".join(filter(None, text)) + "\n" for page, text in pages.items()}, headers


if __name__ == "__main__":
    for name, text in reference()[0].items():
        pathlib.Path(sys.argv[1], name).write_text(text, "utf-8")
