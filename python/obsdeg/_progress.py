"""Progress bars."""

from __future__ import annotations

from typing import Any

from ._results import Progress


def heard(progress: Progress | bool | None) -> tuple[Any, Any]:
    """Function that the engine calls, and the bar to close at the end; ``True`` selects a bar of tqdm."""
    if progress is not None and not isinstance(progress, bool) and not callable(progress):
        raise TypeError(f"progress: found {progress!r} of type {type(progress).__name__}; expected a function, or True for a bar")
    if progress is not True:
        return (progress or None), None
    try:
        from tqdm.auto import tqdm
    except ModuleNotFoundError:
        text = "progress=True draws a bar with the package `tqdm`, which is not installed"
        raise ImportError(f"{text}: pip install 'obsdeg[progress]', or give a function") from None

    bar = tqdm(total=None, leave=False)

    def show(what: str, done: int, total: int | None, examined: int | None, best: float | None) -> bool:
        bar.set_description(what if best is None else f"{what}, best {best:.4g}")
        if total is not None:
            bar.total = total
        bar.update(done - bar.n)
        return True

    return show, bar
