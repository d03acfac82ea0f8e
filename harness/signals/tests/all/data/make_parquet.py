"""Writes the Parquet files that the tests of the crate ``signals`` read.

The files come from pyarrow 26, pandas 3 and polars 2, the libraries with which users write Parquet.
Each file has five rows 20 ms apart, or 1 s apart if the unit of its times is s.
"""

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

rows = np.arange(5)
ns = rows * 20_000_000
torque, rate = rows * 0.1, rows * 0.5
start = 1_767_225_600 * 10**9  # 2026-01-01


def write(name, time, torque=torque, rate=rate, **options):
    """Write a table of time, torque and rate."""
    pq.write_table(pa.table({"time": time, "tau_cmd": torque, "omega": rate}), name, **options)


for unit, one in (("s", 10**9), ("ms", 10**6), ("us", 1000), ("ns", 1)):
    each = ns * 50 if unit == "s" else ns
    write(f"ts_{unit}.parquet", pa.array((start + each) // one, pa.timestamp(unit)))
    write(f"dur_{unit}.parquet", pa.array(each // one, pa.duration(unit)))
write("plain.parquet", pa.array(ns))
write(
    "int96.parquet", pa.array(start + ns, pa.timestamp("ns")), use_deprecated_int96_timestamps=True
)
write(
    "time_half_dec.parquet",
    pa.array(ns // 1000, pa.time64("us")),
    pa.array(torque.astype("float16")),
    pa.array([str(k) for k in rows]).cast(pa.decimal128(20, 3)),
)
of_pandas = {"tau_cmd": torque, "omega": rate}
pd.DataFrame({"time": pd.to_timedelta(ns)} | of_pandas).to_parquet("pandas_td.parquet")
first = pd.Timestamp("2026-01-01")
pd.DataFrame({"time": first + pd.to_timedelta(ns)} | of_pandas).to_parquet("pandas_ts.parquet")
for name, values, kind in (
    ("polars_td", ns // 1000, pl.Duration("us")),
    ("polars_ns", ns, pl.Duration("ns")),
    ("polars_ts", ns // 1000, pl.Datetime("us")),
):
    time = pl.Series(values).cast(kind)
    pl.DataFrame({"time": time} | of_pandas).write_parquet(f"{name}.parquet")
