"""Recordings in every file format give the same table, in the package and in the program."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT, option

from hubslosh import FmuError, read_recording
from hubslosh.recordings import KINDS, convert

ROWS = 200
TIME = np.arange(ROWS) * 0.02  # s
TORQUE = np.round(100 * np.sin(3 * TIME), 3)  # mN·m
RATE = np.round(5 * np.cos(2 * TIME), 3)  # deg/s
COLUMNS = "time={0}t,tau_cmd={0}T_cmd:mNm,omega={0}gyro:deg/s"
BEGIN = np.datetime64("2026-01-31T12:00:00")


def _csv(path: Path) -> None:
    pd.DataFrame({"t [s]": TIME, "T_cmd": TORQUE, "gyro": RATE}).to_csv(path, index=False)


def _semicolons(path: Path) -> None:
    table = pd.DataFrame({"t": 1e3 * TIME, "T_cmd": TORQUE, "gyro": RATE})
    text = table.to_csv(index=False, sep=";", decimal=",").split("\n", 1)
    path.write_text(f"Logger 3000\nSerial;17\n{text[0]}\nms;mNm;deg/s\n{text[1]}", encoding="utf-8")


def _parquet(path: Path) -> None:
    pd.DataFrame({"t_s": TIME, "T_cmd": TORQUE, "gyro": RATE}).to_parquet(path)


def _durations(path: Path) -> None:
    time = pd.to_timedelta(np.round(TIME * 1e9).astype(np.int64))
    pd.DataFrame({"t": time, "T_cmd": TORQUE, "gyro": RATE}).to_parquet(path)


def _mat(path: Path) -> None:
    from scipy.io import savemat

    log = {"t": TIME, "T_cmd": TORQUE[None, :], "gyro": RATE[:, None], "note": "a text", "n": 3.0}
    savemat(path, {"log": log, "cell": np.array(["a", 1], object)}, do_compression=True)


def _mat_73(path: Path) -> None:
    from matio import save_to_mat

    save_to_mat(path, {"t": TIME, "T_cmd": TORQUE, "gyro": RATE}, version="v7.3")


def _timetable(path: Path) -> None:
    from matio import save_to_mat

    time = pd.DatetimeIndex(BEGIN + np.round(TIME * 1e3).astype("timedelta64[ms]"), name="t")
    table = pd.DataFrame({"T_cmd": TORQUE, "gyro": RATE}, time)
    save_to_mat(path, {"log": table}, version="v7")


def _hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["bench/t"] = np.round(TIME * 1e3).astype(np.int32)
        file["bench/t"].attrs["units"] = "ms"
        file["bench/T_cmd"] = TORQUE
        file["bench/gyro"] = RATE


def _tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    wave = {"wf_start_offset": 0.0, "wf_increment": 0.02, "wf_samples": ROWS}
    with TdmsWriter(path) as file:
        file.write_segment(
            [
                ChannelObject("bench", "T_cmd", TORQUE, {"unit_string": "mN.m", **wave}),
                ChannelObject("bench", "gyro", RATE, wave),
            ]
        )


def _mdf(path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(TORQUE, timestamps=TIME, name="T_cmd", unit="mNm")])
        file.append([Signal(RATE, timestamps=TIME, name="gyro", unit="deg/s")])
        file.save(path)


def _excel(path: Path) -> None:
    head = pd.DataFrame([["Bench", None, None], ["t", "T_cmd", "gyro"], ["s", "mNm", "deg/s"]])
    body = pd.DataFrame(np.column_stack([TIME, TORQUE, RATE]))
    pd.concat([head, body]).to_excel(path, header=False, index=False)


Write = Callable[[Path], None]
WRITERS: list[tuple[str, Write, str]] = [
    ("comma.csv", _csv, ""),
    ("semicolon.txt", _semicolons, ""),
    ("plain.parquet", _parquet, ""),
    ("durations.parquet", _durations, ""),
    ("structure.mat", _mat, "log."),
    ("version_7_3.mat", _mat_73, ""),
    ("timetable.mat", _timetable, "log."),
    ("groups.h5", _hdf5, "bench/"),
    ("waveforms.tdms", _tdms, "bench/"),
    ("clocks.mf4", _mdf, ""),
    ("sheet.xlsx", _excel, ""),
]


def _columns(name: str, prefix: str) -> str:
    columns = COLUMNS.format(prefix)
    if name.endswith((".tdms", ".mf4")):  # these formats have times without a column
        columns = columns.replace(f"time={prefix}t,", "")
    return columns


@pytest.mark.parametrize(("name", "write", "prefix"), WRITERS)
def test_every_file_format_gives_the_same_table(
    name: str, write: Write, prefix: str, tmp_path: Path
) -> None:
    """Time, torque and rate are in SI units, whatever clock and units the file has."""
    write(tmp_path / name)
    table = read_recording(tmp_path / name, _columns(name, prefix))
    assert list(table.columns) == ["time", "tau_cmd", "omega"]
    np.testing.assert_allclose(table["time"], TIME, atol=1e-12)
    np.testing.assert_allclose(table["tau_cmd"], TORQUE / 1e3, rtol=1e-15)
    np.testing.assert_allclose(table["omega"], np.radians(RATE), rtol=1e-15)
    assert table.attrs["units"] == {"time": "s", "tau_cmd": "N.m", "omega": "rad/s"}
    assert any(note.startswith("columns used: ") for note in table.attrs["notes"])


def test_times_of_every_parquet_type_are_converted_to_seconds() -> None:
    """The types are timestamps, durations, times of day, Spark dates, decimals and half floats."""
    files = sorted((ROOT / "harness" / "signals" / "tests" / "all" / "data").glob("*.parquet"))
    assert len(files) > 12
    for path in files:
        if path.stem == "plain":
            with pytest.raises(FmuError, match="column time states no unit"):
                read_recording(path)
            continue
        table = read_recording(path)
        step = 1.0 if path.stem.endswith("_s") else 0.02
        np.testing.assert_allclose(table["time"] - table["time"][0], step * np.arange(5), atol=1e-9)
        np.testing.assert_allclose(table["tau_cmd"], 0.1 * np.arange(5), atol=2e-4)


def test_every_file_format_that_can_be_read_has_a_test_file() -> None:
    """Each file format that the package can read has a function above that writes a test file."""
    endings = {Path(name).suffix for name, _, _ in WRITERS}
    assert all(endings & set(kind.endings) for kind in KINDS)


def test_the_command_lets_the_package_read_other_file_formats(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The program calls the Python package, and the results of all formats are equal.

    Without the package the error says how to convert the file.
    """
    program = option(request, "--hubslosh")
    monkeypatch.setenv("HUBSLOSH_PYTHON", sys.executable)
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "harness" / "python"))

    def run(name: str, columns: str) -> subprocess.CompletedProcess[str]:
        command = [program, "gyro", "--recording", tmp_path / name, "--columns", columns]
        return subprocess.run(
            [*command, "--chunk", "1", "--out", tmp_path / "out"], capture_output=True, text=True
        )

    answers = set()
    for name, write, prefix in WRITERS[::6]:
        write(tmp_path / name)
        columns = ",".join(
            each for each in _columns(name, prefix).split(",") if not each.startswith("tau_cmd")
        )
        done = run(name, columns)
        assert not done.returncode, f"{name}: {done.stderr}"
        answers.add("".join(line for line in done.stdout.splitlines(True) if "walk N" in line))
    assert len(answers) == 1 and answers != {""}
    monkeypatch.setenv("PYTHONPATH", "")
    monkeypatch.setenv("PATH", "")
    _mat(tmp_path / "structure.mat")
    done = run("structure.mat", COLUMNS.format("log."))
    assert (
        done.returncode
        and "the file is neither text in columns nor Parquet; the Python package" in (done.stderr)
    )
    assert "pip install 'hubslosh[recordings]'" in done.stderr


def test_signals_with_different_sampling_times_are_not_interpolated(tmp_path: Path) -> None:
    """A slowly sampled torque and a fast gyro keep their own times; missing values are NaN."""
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        slow = TIME[::5] + 0.005
        file.append([Signal(TORQUE[::5], timestamps=slow, name="tau_cmd", unit="mNm")])
        file.append([Signal(RATE, timestamps=TIME, name="omega", unit="deg/s")])
        file.save(tmp_path / "a.mf4")
    table = read_recording(tmp_path / "a.mf4")
    torque, rate = (table.dropna(subset=[name]) for name in ("tau_cmd", "omega"))
    np.testing.assert_allclose(torque["time"], slow, atol=1e-12)
    np.testing.assert_allclose(torque["tau_cmd"], TORQUE[::5] / 1e3, rtol=1e-15)
    np.testing.assert_allclose(rate["time"], TIME, atol=1e-12)
    assert len(table) == len(rate) + len(torque)


def test_a_signal_without_unit_is_announced_or_refused(tmp_path: Path) -> None:
    """Integer times and rates without a unit follow the rules for text files in every format."""
    from scipy.io import savemat

    path = tmp_path / "a.mat"
    savemat(path, {"time": np.arange(50) * 20, "omega": RATE[:50]})
    with pytest.raises(FmuError, match=r"column time states no unit, and its rows are 20\.0 apart"):
        read_recording(path)
    table = read_recording(path, "time=time:ms")
    assert any("omega, no unit stated, taken as rad/s" in note for note in table.attrs["notes"])


def test_unreadable_files_are_refused_with_a_reason(tmp_path: Path) -> None:
    """The files have an unknown format, or columns that are missing or differ in length."""
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"time": TIME, "omega": RATE[:4], "tau_cmd": TORQUE})
    with pytest.raises(FmuError, match=r"line 6, column omega: .*the column ends here"):
        read_recording(tmp_path / "a.mat")
    savemat(tmp_path / "b.mat", {"note": "a text"})
    with pytest.raises(
        FmuError, match=r"b\.mat cannot be used: the file holds no vector or matrix"
    ):
        read_recording(tmp_path / "b.mat")
    _mdf(tmp_path / "c.mf4")
    with pytest.raises(
        FmuError, match=r"no column tau_cmd, omega, .*columns in it: time, T_cmd, g"
    ):
        read_recording(tmp_path / "c.mf4")
    (tmp_path / "d.bin").write_bytes(b"\1\0\2\0" * 99)
    with pytest.raises(
        FmuError, match=r"the format of the file is not known .allowed: text in columns, a \.mat"
    ):
        read_recording(tmp_path / "d.bin")
    with pytest.raises(FmuError, match="cannot be opened"):
        read_recording(tmp_path / "none.csv")
    with pytest.raises(FmuError, match="path must be the path of a file, not int"):
        read_recording(3)  # type: ignore[arg-type]


@pytest.mark.parametrize("copies", [1, pytest.param(6, marks=pytest.mark.long)])
def test_damaged_files_are_read_or_refused_by_name(tmp_path: Path, copies: int) -> None:
    """In a file of each format, bytes are changed or the end is cut off; errors name the file."""
    dice = np.random.default_rng(copies)
    for name, write, prefix in WRITERS[3:]:
        path = tmp_path / name
        write(path)
        whole = bytearray(path.read_bytes())
        for _ in range(copies):
            damaged = bytearray(whole)
            for _ in range(dice.integers(1, 4)):
                damaged[dice.integers(len(damaged))] = dice.integers(256)
            path.write_bytes(damaged[: dice.integers(len(damaged) // 2, len(damaged) + 1)])
            try:
                read_recording(path, _columns(name, prefix))
            except FmuError as error:
                assert name in str(error)


def test_a_small_file_that_declares_a_huge_data_set_is_refused_at_once(tmp_path: Path) -> None:
    """A file of some kilobytes declares a data set of 2^40 values; the values are not read."""
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("time", (1 << 40,), "f8", chunks=(1 << 10,))
    with pytest.raises(FmuError, match=r"the file holds 1099511627776 values .allowed: up to"):
        convert(tmp_path / "a.h5", tmp_path / "a.csv")
    assert not (tmp_path / "a.csv").exists()
