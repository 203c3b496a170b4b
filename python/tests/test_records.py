"""Records as arrays and frames say what the same record says as a file."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import obsdeg
import pytest
from conftest import ROOT

numpy = pytest.importorskip("numpy")
pandas = pytest.importorskip("pandas")
SCHEME, RECORD = "examples/bench-day/scheme.toml", "examples/bench-day/record.csv"
MODEL, DATA = "examples/influenza/model.toml", "examples/influenza/data.csv"
FORCES = ["fx [g]", "fy [g]", "fz [g]"]


@pytest.fixture(autouse=True)
def in_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.fixture(scope="module")
def frame() -> Any:
    return pandas.read_csv(ROOT / RECORD, comment="#", float_precision="round_trip")


@pytest.fixture(scope="module")
def own() -> obsdeg.Calibration:
    """The answer on the file."""
    found = obsdeg.calibrate(obsdeg.Scheme.read(ROOT / SCHEME), ROOT / RECORD)
    assert isinstance(found, obsdeg.Calibration)
    return found


def same(found: Any, own: obsdeg.Calibration) -> None:
    for q, of in zip(found, own, strict=True):
        assert (q.name, q.estimate, q.sigma, q.sigma_rescaled) == (of.name, of.estimate, of.sigma, of.sigma_rescaled)
    assert found.fit == own.fit and found.passed == own.passed


def test_arrays_of_numpy(frame: Any, own: obsdeg.Calibration) -> None:
    scheme = obsdeg.Scheme.read(SCHEME)
    t, f, position = (frame[c].to_numpy() for c in ("t [s]", FORCES, "position"))
    same(obsdeg.calibrate(scheme, t=t, f=f, position=position), own)
    # numbers of positions; lists; a mapping whose order is not that of the axes
    numbers = frame["position"].str[1:].astype(float)
    same(obsdeg.calibrate(scheme, t=t, f=f, position=numbers), own)
    same(obsdeg.calibrate(scheme, t=t.tolist(), f=f.tolist(), position=numbers.fillna(0).astype(int).tolist()), own)
    by_name = {axis: frame[f"f{axis} [g]"] for axis in "zxy"}
    same(obsdeg.calibrate(scheme, t=t, f=by_name, position=position), own)
    # spans of time are exact to a microsecond
    spans = obsdeg.calibrate(SCHEME, t=pandas.to_timedelta(frame["t [s]"], unit="s"), f=frame[FORCES], position=position)
    assert [q.estimate for q in spans] == pytest.approx([q.estimate for q in own], rel=1e-4)


def test_frames_and_streams(frame: Any, own: obsdeg.Calibration, tmp_path: Path) -> None:
    pyarrow, polars = pytest.importorskip("pyarrow"), pytest.importorskip("polars")
    table = pyarrow.Table.from_pandas(frame, preserve_index=False)
    given = [frame, table, polars.from_arrow(table), io.StringIO(Path(RECORD).read_text()), io.BytesIO(Path(RECORD).read_bytes())]
    given += [frame.set_index("t [s]"), frame.convert_dtypes(), {c: frame[c] for c in frame}, table.to_batches()[0]]
    for record in given:
        same(obsdeg.calibrate(SCHEME, record), own)

    class Stream:
        """A frame of a library that nobody knows."""

        def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
            return table.__arrow_c_stream__(requested_schema)

    same(obsdeg.calibrate(SCHEME, Stream()), own)


def test_dates(frame: Any) -> None:
    begin = pandas.Timestamp("2024-03-01T08:00:00.5")
    dates = (begin + pandas.to_timedelta(frame["t [s]"], unit="s")).dt.round("us")
    texts = frame.drop(columns="t [s]").assign(t=[d.isoformat() for d in dates])
    own = obsdeg.calibrate(SCHEME, io.StringIO(texts.to_csv(index=False)))
    assert isinstance(own, obsdeg.Calibration)
    forces = frame.drop(columns="t [s]")
    same(obsdeg.calibrate(SCHEME, forces.set_index(pandas.DatetimeIndex(dates))), own)
    same(obsdeg.calibrate(SCHEME, forces.assign(t=dates)), own)
    same(obsdeg.calibrate(SCHEME, t=dates.to_numpy(), f=frame[FORCES].to_numpy(), position=frame["position"]), own)
    same(obsdeg.calibrate(SCHEME, t=dates.dt.tz_localize("Europe/Berlin") + pandas.Timedelta(hours=1), f=frame[FORCES], position=frame["position"]), own)
    indexed = frame[FORCES].set_index(pandas.DatetimeIndex(dates, tz="UTC"))
    same(obsdeg.calibrate(SCHEME, f=indexed, position=frame["position"].to_numpy()), own)


def test_missing_samples_are_reported(frame: Any) -> None:
    f = frame[FORCES].to_numpy(copy=True)
    f[5, 0] = numpy.nan
    f[9:12, 2] = numpy.nan
    asked: dict[str, Any] = dict(t=frame["t [s]"], position=frame["position"])
    found = obsdeg.calibrate(SCHEME, f=f, **asked)
    assert isinstance(found, obsdeg.Calibration)
    assert {c.column: c.count for c in found.records[0].empty_cells} == {"fx [g]": 1, "fz [g]": 3}
    masked = numpy.ma.masked_invalid(f)
    assert obsdeg.calibrate(SCHEME, f=masked, **asked) == found
    # as if the cells were empty in the file
    text = frame.assign(**dict(zip(FORCES, f.T, strict=True))).to_csv(index=False)
    same(obsdeg.calibrate(SCHEME, io.StringIO(text)), found)


def test_models(frame: Any) -> None:
    data = pandas.read_csv(DATA, comment="#")
    own = obsdeg.calibrate(MODEL, DATA)
    t, ill = data["t [d]"], data["in_bed"]
    model = obsdeg.Model.read(MODEL)
    for found in (
        obsdeg.calibrate(model, t=t, outputs={"in_bed": ill}),
        obsdeg.calibrate(model, t=t.to_numpy(), outputs={"in_bed": ill.to_numpy()}),
        obsdeg.calibrate(MODEL, outputs={"in_bed": ill.set_axis(pandas.Index(t, name="t"))}),
        obsdeg.calibrate(model, {"t [d]": list(t), "in_bed": list(ill)}),
    ):
        assert [(q.name, q.estimate, q.sigma) for q in found] == [(q.name, q.estimate, q.sigma) for q in own]
    fewer = obsdeg.calibrate(model, t=t, outputs={"in_bed": [*ill[:-2], None, float("nan")]})
    assert fewer.outputs[0].measurements == 12


@pytest.mark.parametrize(
    ("record", "message"),
    [
        (dict(t=[0, 1], f=[[0, 0, 1]] * 3), "arrays: found 2 of t .s., 3 of fx"),
        (dict(t=[0, 1], f=[[0, 1]] * 2), "f: found rows of 2 numbers; expected three"),
        (dict(t=[0, 1]), "t or position without f or outputs"),
        (dict(f=[[0, 0, 1]]), "found no times; expected t="),
        (dict(t=[0, 1], f=[[0, 0, 1]] * 2, position=[1, 7]), "position: found 7; expected a name, or a number from 1 to 6"),
        (dict(t=[0, 1], f=[[0, 0, 1]] * 2, position=[1, 1.5]), "position: found 1.5"),
        (dict(t=[0, 1], f=[[0, 0, 1]] * 2, outputs={"y": [1, 2]}), "found f and outputs"),
        (dict(t=[0, 1], f={"x": [1, 2], "y": [1, 2]}), "f: found the columns x, y; expected three"),
        (dict(t=3, f=[[0, 0, 1]]), "found a column of type int"),
    ],
)
def test_what_is_no_record_is_refused(record: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        obsdeg.calibrate(obsdeg.Scheme.read(SCHEME), **record)
    for wrong in (3, None, [1, 2], numpy.zeros((3, 4))):
        with pytest.raises(TypeError, match="record 1: found a .*; expected a file"):
            obsdeg.calibrate(SCHEME, wrong)
