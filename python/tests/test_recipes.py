"""The recipes of the book for clusters run as they are written, with a local cluster in place of Slurm and Kubernetes."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from conftest import ROOT
from obsdeg import campaign

distributed = pytest.importorskip("distributed")
pytest.importorskip("pandas")
BOOK = (ROOT / "book" / "src" / "python.md").read_text(encoding="utf-8")
#: Recipes by the module of their cluster.
RECIPES = {found[1]: block for block in re.findall(r"```text\n(.*?)```", BOOK, re.DOTALL) if (found := re.match(r"from (dask_[.\w]+) import", block))}
CLUSTERS = {"dask_jobqueue": "SLURMCluster", "dask_kubernetes.operator": "KubeCluster"}


def run(module: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Runs a recipe in a folder. Returns the options of its cluster, and those of its scaling."""
    asked: list[dict[str, Any]] = []

    class Local(distributed.LocalCluster):  # type: ignore[misc, name-defined]
        def __init__(self, **options: Any) -> None:
            asked.append(options)
            super().__init__(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None)

        def scale(self, *numbers: Any, **options: Any) -> Any:
            # numbers are those of the local cluster itself
            return super().scale(*numbers, **options) if numbers else asked.append(options)

    stand_in = ModuleType(module)
    setattr(stand_in, CLUSTERS[module], Local)
    monkeypatch.setitem(sys.modules, module.partition(".")[0], ModuleType(module.partition(".")[0]))
    monkeypatch.setitem(sys.modules, module, stand_in)
    monkeypatch.chdir(folder)
    exec(compile(RECIPES[module].replace("/shared/", ""), module, "exec"), {"__name__": "__main__"})  # noqa: S102
    return asked


@pytest.mark.parametrize("module", CLUSTERS)
def test_recipes_run_with_a_local_cluster(module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert set(RECIPES) == set(CLUSTERS)
    asked = run(module, tmp_path, monkeypatch)
    assert len(asked) == (2 if module == "dask_jobqueue" else 1)
    rows = campaign.read(tmp_path / "sweep")
    assert rows["task"].nunique() == 6 * 4 * 2 and "error" not in rows and rows["sigma"].notna().all()
