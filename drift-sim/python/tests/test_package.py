"""Types, examples in docs, the guide and the notebook."""

import contextlib
import fnmatch
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import nbclient
import nbformat
import pytest

import drift

HERE = Path(__file__).resolve().parents[1]


def checked(*arguments) -> None:
    done = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, cwd=HERE, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_types_are_strict():
    checked("mypy", "--config-file", "pyproject.toml")


def test_the_stub_is_of_the_module():
    checked("mypy.stubtest", "drift._drift", "--ignore-disjoint-bases")


def test_everything_public_has_docs():
    assert sorted(drift.__all__) == drift.__all__
    for name in drift.__all__:
        public = getattr(drift, name)
        if isinstance(public, type):
            members = [member for key, member in vars(public).items() if not key.startswith("_")]
            documented = [member for member in members if callable(member) or isinstance(member, property | classmethod)]
            assert all(member.__doc__ for member in documented), name
        assert public.__doc__, name


def blocks(page: Path):
    """The guide's blocks of Python, each with what it must print."""
    fence = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
    found = [(match[1], match[2]) for match in fence.finditer(page.read_text(encoding="utf-8"))]
    for (language, text), following in zip(found, [*found[1:], ("", "")], strict=True):
        if language == "python":
            yield text, following[1] if following[0] == "text" else None


def test_the_guide_prints_what_it_says(root, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.symlink(root / "examples", tmp_path / "examples")
    everything: dict[str, object] = {}
    count = 0
    for text, said in blocks(root / "docs/python.md"):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(text, "docs/python.md", "exec"), everything)
        count += 1
        if said is not None:
            # `...` stands for anything, in a line or of lines.
            pattern = re.sub(r"\[", "[[]", said.strip()).replace("...", "*")
            assert fnmatch.fnmatchcase(printed.getvalue().strip(), pattern), f"{text}\nprints\n{printed.getvalue()}"
    assert count >= 8


@pytest.mark.parametrize("path", sorted((HERE / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_the_notebook_runs_with_pictures(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "kept without outputs"
    done = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [kind for cell in done.cells for output in cell.get("outputs", []) for kind in output.get("data", {})]
    assert shown.count("image/png") >= 4
    assert shown.count("text/html") >= 3
