"""Hooks of mkdocs.yml: README.md is the site's first page, CONTRIBUTING.md and CHANGELOG.md are others."""
import pathlib
import re
import tempfile

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
TEMPORARY = tempfile.TemporaryDirectory()


def on_files(files, config):
    for source, name in PAGES.items():
        text = (ROOT / source).read_text(encoding="utf-8").replace("](docs/", "](")
        for other, page in PAGES.items():
            text = text.replace(f"]({other}", f"]({page}")
        (pathlib.Path(TEMPORARY.name) / name).write_text(text, encoding="utf-8")
        files.append(File(name, TEMPORARY.name, config["site_dir"], config["use_directory_urls"]))
    for file in list(files):
        if file.src_path.endswith((".py", ".mjs")):
            files.remove(file)
    return files


def on_page_markdown(markdown, **_):
    """Lists need an empty line before them here, and a bracket at a box's place is a box."""
    return re.sub(r"^- \[ \] ", "- ☐ ", markdown, flags=re.M)
