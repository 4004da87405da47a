"""What the documents show is run."""

import re
import warnings

import pytest

from conftest import MODELS, ROOT

SKIPPED = ("Client(", "SLURMCluster", "hyperqueue", "LocalCluster", "gl.convert.")


def _blocks(name):
    text = (ROOT / name).read_text()
    return [block for block in re.findall(r"```python\n(.*?)```", text, re.S) if not any(word in block for word in SKIPPED)]


@pytest.mark.parametrize("name", ["docs/python.md", "python/README.md", "README.md"])
def test_examples_of_documents_run_one_after_another(name, monkeypatch, tmp_path):
    import matplotlib

    matplotlib.use("Agg")
    blocks = _blocks(name)
    assert blocks
    # Files that are written go elsewhere, models are found as from the root.
    (tmp_path / "models").symlink_to(MODELS)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec("import numpy as np, pyarrow, polars", names)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for block in blocks:
            exec(compile(block, name, "exec"), names)
