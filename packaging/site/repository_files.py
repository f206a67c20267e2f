# SPDX-License-Identifier: Apache-2.0
"""For mkdocs: files outside of docs/ to which documents link become part of the site. README.md is its first page; other files keep their path in the
repository, so that links work in the repository and in the site."""
import pathlib
import posixpath
import re

from mkdocs.structure.files import File

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
FIRST_PAGES = {"README.md": "index.md"}
PAGES = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "training/README.md"]
LINK = re.compile(r"(\]\()([^)#\s:]+)((?:#[^)\s]*)?\))")


def place(repository_path):
    """Where a file of the repository is in the site."""
    inside = repository_path[len("docs/"):] if repository_path.startswith("docs/") else repository_path
    return FIRST_PAGES.get(repository_path, inside)


def targets(text, folder):
    for match in LINK.finditer(text):
        yield posixpath.normpath(posixpath.join(folder, match.group(2)))


def on_files(files, config):
    linked = {t for page in REPOSITORY.glob("docs/**/*.md")
              for t in targets(page.read_text(encoding="utf-8"), page.parent.relative_to(REPOSITORY).as_posix())}
    linked |= {t for page in PAGES for t in targets((REPOSITORY / page).read_text(encoding="utf-8"), posixpath.dirname(page))}
    outside = {t for t in linked if not t.startswith(("docs/", "..")) and (REPOSITORY / t).is_file()}
    for path in sorted(outside | set(PAGES)):
        files.append(File.generated(config, place(path), content=(REPOSITORY / path).read_bytes()))
    return files


def on_page_markdown(markdown, page, config, files):
    at = page.file.src_uri
    source = next((r for r, s in FIRST_PAGES.items() if s == at), at if at in PAGES else f"docs/{at}")

    def moved(match):
        target = posixpath.normpath(posixpath.join(posixpath.dirname(source), match.group(2)))
        if (REPOSITORY / target).is_dir():
            return match.group(0)
        return match.group(1) + posixpath.relpath(place(target), posixpath.dirname(at) or ".") + match.group(3)

    return LINK.sub(moved, markdown)
