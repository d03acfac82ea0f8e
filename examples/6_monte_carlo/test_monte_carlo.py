"""The study gives the results of single runs; the README's study has 400 runs."""

import pandas as pd
from distributed import Client
from monte_carlo import STOP, draws, one, study


def test_dask_and_processes_give_the_results_of_single_runs(fmu: str) -> None:
    """A study by Dask (16 runs) and one by processes (4 runs) give the results of single runs.

    Stable and unstable draws occur, as do settled and unsettled ones.
    """
    with Client(
        processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None
    ) as client:
        table = study(client, 16, 1, fmu)
    pd.testing.assert_frame_equal(table.iloc[:, :4], draws(16, 1))
    alone = study(None, 4, 1, fmu)
    assert all(
        one(row, fmu) == found
        for row, found in zip(
            alone.iloc[:, :4].to_dict("records"), alone.iloc[:, 4:].to_dict("records"), strict=True
        )
    )
    for k in (0, 7):
        found = one(table.iloc[k, :4].to_dict(), fmu)
        assert found == table.iloc[k, 4:].to_dict()
    assert 0 < (table["largest_pole"] < 1).sum() < 16
    # Damping decides stability; dry friction decides the settling time.
    correlation = table.corr(method="spearman")
    assert correlation.loc["slosh.zeta", "largest_pole"] < -0.8
    assert correlation.loc["friction.c", "settling_time"] < -0.6
    assert table["settling_time"].between(5, STOP).all()
