"""What mkdocs does not do by itself for a site that is opened from files."""

import glob
import json
import os
import re
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import headers
import older

KATEX = "/usr/share/javascript/katex"  # Debian's libjs-katex
# A block of code, which stays, or a link: its text and target.
LINK = re.compile(r"^ *```[\s\S]*?^ *```$|(?<!!)\[([^\]]+)\]\((?!https?:|mailto:|#)([^)#\s]+)[^)]*\)", re.M)


def repository_link(text, path, folder):
    """A link to what only the repository has: to the C++ reference if it says what the header has, else the path as code."""
    page, anchor, names = headers.reference()[1].get(path, (None, None, None))
    if page:
        anchor = next((names[word] for word in re.findall(r"\w+", text) if word in names), anchor)
        return f"[{text}]({os.path.relpath(f'reference/cpp/{page}', folder)}#{anchor})"
    return f"`{path}`" if path.endswith(text.strip("`/")) else f"{text} (`{path}`)"


def on_page_markdown(markdown, page, config, files):
    """A link to what only the repository has leads to what the site has of it, since the site is read without the repository."""
    page.title = page.title.replace("`", "")  # the navigation shows no code
    folder = os.path.dirname(page.file.src_uri)

    def replace(match):
        if not match[2]:
            return match[0]
        path = os.path.normpath(os.path.join(folder, match[2]))
        return match[0] if files.get_file_from_path(path) else repository_link(match[1], path, folder)

    if folder == "docs/results":
        markdown = older.marked(markdown)
    return LINK.sub(replace, markdown)


def on_post_page(output, page, config):
    """Takes away the theme's blank lines before a page's content: in the navigation of every page they were a quarter of the site."""
    navigation, mark, content = output.partition('<div class="md-content"')
    return re.sub(r"\s*\n\s*", "\n", navigation) + mark + content


def list_versions(folder):
    """Writes what the pages of each version in `folder` read of the others, and a page that leads to the newest."""
    names = [os.path.basename(os.path.dirname(path)) for path in glob.glob(f"{folder}/*/search")]
    names.sort(key=lambda name: (name == "newest", [int(part) for part in re.findall(r"\d+", name)]), reverse=True)
    pages = {name: sorted(glob.glob("**/*.html", root_dir=f"{folder}/{name}", recursive=True)) for name in names}
    with open(f"{folder}/versions.js", "w", encoding="utf-8") as file:
        file.write(f"var __versions = {json.dumps(pages)};\n")
    with open(f"{folder}/index.html", "w", encoding="utf-8") as file:
        file.write(f'<!doctype html><title>Poise</title><meta http-equiv="refresh" content="0; url={names[0]}/index.html">\n')


def on_post_build(config):
    site = config["site_dir"]

    # A page from a file may neither fetch the index nor start a worker from a file: a script brings both.
    with open(f"{site}/search/search_index.json", encoding="utf-8") as file:
        index = json.load(file)
    for entry in index["docs"]:
        if re.match("docs/lab/.+/2|CHANGELOG|reference/", entry["location"]):
            entry["boost"] = 0.2  # what explains comes before what was once, and before the longest lists
    [worker] = glob.glob(f"{site}/assets/javascripts/workers/search.*.js")
    with open(worker, encoding="utf-8") as file:
        source = file.read().replace("this.add(s)", "this.add(s,{boost:s.boost||1})")  # Debian 12's theme has no boosts
    with open(f"{site}/search/search_index.js", "w", encoding="utf-8") as file:
        file.write(f"var __index = {json.dumps(index)};\nvar __search_worker = {json.dumps(source)};\n")

    katex = f"{site}/assets/katex"
    os.makedirs(f"{katex}/fonts", exist_ok=True)
    for name in ("katex.min.css", "katex.min.js", "contrib/auto-render.js"):
        shutil.copy(f"{KATEX}/{name}", katex)
    for font in glob.glob(f"{KATEX}/fonts/*.woff2"):
        shutil.copy(font, f"{katex}/fonts")

    # What only a server, the theme's makers or other languages use.
    for path in [f"{site}/404.html", *glob.glob(f"{site}/sitemap.xml*"), *glob.glob(f"{site}/assets/**/*.map", recursive=True)]:
        os.remove(path)
    shutil.rmtree(f"{site}/assets/javascripts/lunr", ignore_errors=True)
    list_versions(os.path.dirname(site))
