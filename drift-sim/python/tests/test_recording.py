"""Recordings: whatever holds the numbers, the same recording; refused input says the line that files say."""

import sys

import numpy as np
import pandas
import polars
import pyarrow
import pytest

import drift


def same(one: drift.Recording, other: drift.Recording) -> None:
    assert one.sample_time_s == other.sample_time_s
    assert one.start_s == other.start_s
    assert one.zero_s == other.zero_s
    for name in "ryu":
        np.testing.assert_array_equal(one[name], other[name])
    np.testing.assert_array_equal(one.valid, other.valid)


def test_all_tables_are_one_recording(table, tmp_path):
    path = tmp_path / "log.csv"
    pandas.DataFrame(table).to_csv(path, index=False)
    from_file = drift.Recording.read(path)
    # Stamps of two decimals hide 66 ms.
    assert from_file.sample_time_s == 0.066
    structured = np.rec.fromarrays(list(table.values()), names=list(table))
    for held in (
        table,
        {name: list(values) for name, values in table.items()},
        pandas.DataFrame(table),
        pandas.DataFrame(table).set_index("time"),
        pandas.DataFrame(table).convert_dtypes(),
        polars.DataFrame(table),
        pyarrow.table(table),
        pyarrow.table(table).to_batches()[0],
        structured,
        OnlyArrow(pyarrow.table(table)),
    ):
        read = drift.Recording.from_table(held)
        same(read, from_file)
        assert read.columns == {"t": "time", "r": "SP", "y": "PV", "u": "OP"}
    same(drift.Recording(table["time"], table["SP"], table["PV"], table["OP"]), from_file)


class OnlyArrow:
    """Nothing but the PyCapsule interface."""

    def __init__(self, table):
        self._table = table

    def __arrow_c_stream__(self, requested_schema=None):
        return self._table.__arrow_c_stream__(requested_schema)


def test_dates_count_as_they_do_in_a_file(table, tmp_path):
    start = np.datetime64("2024-05-01T12:00:00")
    stamps = start + (np.arange(300) * 250).astype("timedelta64[ms]")
    frame = pandas.DataFrame({**table, "time": stamps})
    path = tmp_path / "log.csv"
    frame.to_csv(path, index=False)
    from_file = drift.Recording.read(path)
    assert from_file.sample_time_s == 0.25
    assert from_file.zero_s == float(start.astype("datetime64[s]").astype(int))
    same(drift.Recording.from_table(frame), from_file)
    same(drift.Recording.from_table(polars.from_pandas(frame)), from_file)
    same(drift.Recording.from_table(pyarrow.Table.from_pandas(frame)), from_file)
    same(drift.Recording.from_table(frame.set_index("time")), from_file)
    zoned = frame.assign(time=frame["time"].dt.tz_localize("Europe/Berlin"))
    assert drift.Recording.from_table(zoned).zero_s == from_file.zero_s - 7200
    assert drift.Recording.from_table(polars.from_pandas(zoned)).zero_s == from_file.zero_s - 7200


def test_what_is_missing_is_missing(table):
    frame = pandas.DataFrame(table)
    frame.loc[7, "PV"] = np.nan
    frame = frame.drop(index=range(100, 110)).reset_index(drop=True)
    for held in (frame, frame.convert_dtypes(), polars.from_pandas(frame), pyarrow.Table.from_pandas(frame)):
        read = drift.Recording.from_table(held)
        assert len(read) == 300
        assert np.flatnonzero(~read.valid).tolist() == [7, *range(100, 110)]


def test_text_says_where_the_loop_is_closed(table):
    mode = ["AUTO"] * 200 + ["MAN"] * 100
    for held in (pandas.DataFrame({**table, "MODE": mode}), polars.DataFrame({**table, "MODE": mode})):
        read = drift.Recording.from_table(held)
        assert read.manual.sum() == 100
        assert drift.Recording.from_table(held, when="MODE=MAN").manual.sum() == 200
    closed = np.arange(300) < 200
    read = drift.Recording(table["time"], table["SP"], table["PV"], table["OP"], closed=closed)
    np.testing.assert_array_equal(read.manual, ~closed)


def test_arrays_come_out_without_a_copy_and_read_only(table):
    read = drift.Recording.from_table(table)
    one, other = read.y, read.y
    assert np.shares_memory(one, other)
    assert not one.flags.owndata
    with pytest.raises(ValueError, match="read-only"):
        one[0] = 1.0
    with pytest.raises(ValueError, match="cannot set WRITEABLE"):
        one.flags.writeable = True
    # The numbers live as long as an array shows them.
    del read
    np.testing.assert_array_equal(one, table["PV"])


def test_views_keep_the_recording_alive(table):
    read = drift.Recording.from_table(table)
    before = sys.getrefcount(read._inner)
    view = read.u
    during = sys.getrefcount(read._inner)
    del view
    after = sys.getrefcount(read._inner)
    assert (during, after) == (before + 1, before)


def test_single_precision_strides_and_integers(table):
    t, y = table["time"], table["PV"]
    wide = np.repeat(np.column_stack([t, y]), 2, axis=0)[::2]
    assert not wide[:, 1].flags.c_contiguous
    r = np.ones(300, dtype=np.int64)
    read = drift.Recording(wide[:, 0], r, wide[:, 1], y.astype(np.float32))
    np.testing.assert_array_equal(read.y, y)
    np.testing.assert_array_equal(read.u, y.astype(np.float32).astype(np.float64))


def test_no_reference_and_no_stamps(table):
    read = drift.Recording(None, None, table["PV"], table["OP"], sample_time_s=0.5)
    assert read.sample_time_s == 0.5
    assert (read.r == np.sort(table["PV"])[150]).all()
    assert "the controller is taken to hold" in read.notes[-1]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"time": [0.0, 0.1, 0.2, 0.1]}, "table:4: time goes back from 0.2 to 0.1 s"),
        ({"time": [0.0, 0.1, 0.25, 0.33]}, "the sampling is not uniform"),
        ({"PV": ["1", "x", "2", "3"]}, "table:1: '1' in column 'PV' is not a number"),
        ({"PV": [1.0, 2.0]}, "values"),
        ({"OP": None}, "no column 'u' for u"),
    ],
)
def test_errors_are_the_line_of_files(change, line):
    held = {"time": [0.0, 0.1, 0.2, 0.3], "SP": [1.0] * 4, "PV": [1.0, 2.0, 3.0, 4.0], "OP": [0.0] * 4, **change}
    held = {name: values for name, values in held.items() if values is not None}
    with pytest.raises(drift.DriftError) as refused:
        drift.Recording.from_table(held)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)
    assert isinstance(refused.value, ValueError)


def test_errors_are_those_of_the_command(tmp_path, run_command):
    path = tmp_path / "bad.csv"
    path.write_text("t,r,y,u\n0,1,1,1\n0.1,1,x,1\n0.2,1,1,1\n")
    with pytest.raises(drift.DriftError) as here:
        drift.Recording.read(path)
    with pytest.raises(RuntimeError) as there:
        run_command("init", path)
    assert f"error: {here.value}" == str(there.value)


def test_wrong_types_are_type_errors(table):
    with pytest.raises(TypeError, match="int is no recording"):
        drift.look(7)
    with pytest.raises(TypeError, match="unknown keyword 'colums'"):
        drift.Recording.from_table(table, colums="y=PV")
    with pytest.raises(TypeError, match="has been read already"):
        drift.init(drift.Recording.from_table(table), columns="y=PV")


def test_columns_by_name(table):
    renamed = {"a, b": table["time"], "c": table["SP"], "d": table["PV"], "e": table["OP"]}
    read = drift.Recording.from_table(renamed, columns={"t": "a, b", "r": "c", "y": "d", "u": "e"})
    np.testing.assert_array_equal(read.y, table["PV"])
    assert drift.Recording.from_table(table, columns="t=time,r=,y=PV,u=OP").r.std() == 0


def test_a_look_says_what_is_there(table):
    seen = drift.look(pandas.DataFrame(table))
    assert seen.names == ["time", "SP", "PV", "OP"]
    assert seen.sample_time_s == 0.066
    assert seen.lacks is None
    assert "every 0.066 s, uniform" in repr(seen)
    assert len(seen) == 300
    no_u = drift.look({"time": table["time"], "SP": table["SP"], "PV": table["PV"], "abc": table["OP"]})
    assert no_u.lacks is not None
    assert drift.look(drift.Recording.from_table(table)).sample_time_s == pytest.approx(0.066)


def test_to_dict_makes_a_frame(table):
    read = drift.Recording.from_table({**table, "outdoor": np.arange(300.0)})
    frame = pandas.DataFrame(read.to_dict())
    assert list(frame.columns) == ["t", "r", "y", "u", "outdoor"]
    assert frame["outdoor"].iloc[-1] == 299


def test_a_simulated_run_is_a_recording(oven):
    run = drift.simulate(oven, duration_s=400_000, reference_mean=35.0, reference_sd=3.0, reference_hold=200)
    of_run = drift.calibrate(run, window_s=1000.0)
    assert of_run.to_dict() == drift.calibrate(run.to_recording(), window_s=1000.0).to_dict()
    assert drift.monitor(run, of_run).summary["samples"] == len(run)
    assert len(drift.look(run)) == len(run)
