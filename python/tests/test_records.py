"""A record as arrays or frames gives the same answer as its file."""

from __future__ import annotations

import io
from typing import Any

import obsdeg
import pytest
from conftest import ROOT
from obsdeg._frames import arrays, record

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
    return pandas.read_csv(ROOT / RECORD, comment="#")


@pytest.fixture(scope="module")
def own() -> obsdeg.Calibration:
    """Answer for the file."""
    found = obsdeg.calibrate(obsdeg.Scheme.read(ROOT / SCHEME), ROOT / RECORD)
    assert isinstance(found, obsdeg.Calibration)
    return found


def same(found: Any, own: obsdeg.Calibration) -> None:
    for q, of in zip(found, own, strict=True):
        assert (q.name, q.estimate, q.sigma, q.sigma_rescaled) == (of.name, of.estimate, of.sigma, of.sigma_rescaled)
    assert found.fit == own.fit and found.passed == own.passed


def read(given: tuple[str, bytes | None]) -> Any:
    """Content of a record, read by pandas."""
    assert given[1] is not None
    return pandas.read_csv(io.BytesIO(given[1]))


def test_arrays_of_numpy(frame: Any, own: obsdeg.Calibration) -> None:
    scheme = obsdeg.Scheme.read(SCHEME)
    t, f, position = (frame[c].to_numpy() for c in ("t [s]", FORCES, "position"))
    # numbers of positions in place of their names
    numbers = frame["position"].str[1:].astype(float)
    same(obsdeg.calibrate(scheme, t=t, f=f, position=numbers), own)
    names = ["p1", "p2", "p3", "p4", "p5", "p6"]
    by_name = {axis: frame[f"f{axis} [g]"] for axis in "zxy"}
    for given in (
        arrays(t, f, position, None),
        arrays(t.tolist(), f.tolist(), numbers.fillna(0).astype(int).tolist(), None, names),
        arrays(t, by_name, position, None),
        arrays(frame["t [s]"], frame[FORCES], frame["position"], None),
        arrays(None, frame.set_index("t [s]")[FORCES], numbers, None, names),
    ):
        assert given and read(given).equals(frame)
    spans = arrays(pandas.to_timedelta(frame["t [s]"], unit="s"), f, position, None)
    # time spans are exact to a microsecond
    assert spans and list(read(spans)["t [s]"]) == pytest.approx(list(t), abs=1e-6)


def test_frames_and_streams(frame: Any, own: obsdeg.Calibration) -> None:
    pyarrow, polars = pytest.importorskip("pyarrow"), pytest.importorskip("polars")
    table = pyarrow.Table.from_pandas(frame, preserve_index=False)

    class Stream:
        """Frame of an unknown library."""

        def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
            return table.__arrow_c_stream__(requested_schema)

    given = [frame, table, polars.from_arrow(table), frame.set_index("t [s]"), frame.convert_dtypes(), {c: frame[c] for c in frame}, Stream()]
    given += [io.StringIO(frame.to_csv(index=False)), io.BytesIO(frame.to_csv(index=False).encode())]
    for one in given:
        assert read(record(one, 1)).equals(frame), type(one)
    same(obsdeg.calibrate(SCHEME, polars.from_arrow(table)), own)


def test_dates() -> None:
    data = pandas.read_csv(DATA, comment="#")
    days = pandas.Timestamp("1978-01-22T12:00:00.25") + pandas.to_timedelta(data["t [d]"], unit="D")
    texts = pandas.DataFrame({"t": [day.isoformat() for day in days], "in_bed": data["in_bed"]})
    own = obsdeg.calibrate(MODEL, io.StringIO(texts.to_csv(index=False)))
    zoned = days.dt.tz_localize("UTC").dt.tz_convert("Europe/London")
    ill = data[["in_bed"]]
    for given in (
        record(ill.set_index(pandas.DatetimeIndex(days)), 1),
        record(ill.assign(t=days)[["t", "in_bed"]], 1),
        record({"t [s]": days.to_numpy(), "in_bed": ill["in_bed"]}, 1),
        arrays(zoned, None, None, {"in_bed": ill["in_bed"]}),
        arrays(None, None, None, {"in_bed": ill["in_bed"].set_axis(pandas.DatetimeIndex(zoned))}),
    ):
        assert given and list(read(given)["t"]) == list(texts["t"])
        assert list(read(given)["in_bed"]) == list(texts["in_bed"])
    found = obsdeg.calibrate(MODEL, t=zoned, outputs={"in_bed": ill["in_bed"]})
    assert [(q.name, q.estimate) for q in found] == [(q.name, q.estimate) for q in own]


def test_missing_samples_are_reported(frame: Any) -> None:
    f = frame[FORCES].to_numpy(copy=True)
    f[5, 0] = numpy.nan
    f[9:12, 2] = numpy.nan
    asked: dict[str, Any] = dict(t=frame["t [s]"], position=frame["position"])
    found = obsdeg.calibrate(SCHEME, f=f, **asked)
    assert isinstance(found, obsdeg.Calibration)
    assert {c.column: c.count for c in found.records[0].empty_cells} == {"fx [g]": 1, "fz [g]": 3}
    # equivalent to empty cells in a file
    holes = frame.assign(**dict(zip(FORCES, f.T, strict=True)))
    masked = arrays(asked["t"], numpy.ma.masked_invalid(f), asked["position"], None)
    assert masked and read(masked).equals(holes) and b",," in (masked[1] or b"")
    assert read(record(holes, 1)).equals(holes) and b"nan" not in (record(holes, 1)[1] or b"").lower()


def test_a_series() -> None:
    t = numpy.arange(0, 10, 0.1)
    decay = obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"})
    series = pandas.Series(3 * numpy.exp(-0.7 * t), index=pandas.Index(t, name="t"), name="y")
    for fit in (obsdeg.calibrate(decay, series), obsdeg.calibrate(decay, outputs={"y": series})):
        assert fit["k"].estimate == pytest.approx(0.7)
    with pytest.raises(TypeError, match="an index of dates, or named t or time"):
        obsdeg.calibrate(decay, outputs={"y": series.rename_axis(None)})


def test_models() -> None:
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
    ("given", "message"),
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
def test_what_is_no_record_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        obsdeg.calibrate(obsdeg.Scheme.read(SCHEME), **given)
    for wrong in (3, None, [1, 2], numpy.zeros((3, 4))):
        with pytest.raises(TypeError, match="record 1: found a .*; expected a file"):
            obsdeg.calibrate(SCHEME, wrong)
