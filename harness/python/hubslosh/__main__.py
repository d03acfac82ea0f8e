"""Calls the program ``hubslosh``, or drives the HubSlosh FMU through a torque history.

    python -m hubslosh book
    python -m hubslosh --input torque.csv --out answer.csv --set slosh.model=spherical

The first form takes every command of the program and needs no folder on PATH. The second form has
straight lines from row to row.
"""

import argparse
import subprocess
import sys
from pathlib import Path

from .command import find_program
from .fmu import FmuError
from .plant import COLUMNS, TORQUE, drive
from .tables import ending_of, read_table, setting, write_table


def main() -> None:
    """Run the command line ``python -m hubslosh``: a command of the program, or a simulation."""
    if sys.argv[1:] and not sys.argv[1].startswith("-"):
        try:
            sys.exit(subprocess.run([find_program(), *sys.argv[1:]], check=False).returncode)
        except FmuError as error:
            sys.exit(f"error: {error}")
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--fmu", default="HubSlosh", metavar="FILE")
    parser.add_argument(
        "--input", type=Path, required=True, metavar="FILE",
        help="columns time (s) and tau_cmd (N·m), .csv or .parquet",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, metavar="FILE")
    parser.add_argument(
        "--set", type=setting, action="append", default=[], metavar="NAME=VALUE", dest="settings",
        help="a parameter or an input by its FMU name, SI units",
    )  # fmt: skip
    parser.add_argument("--tolerance", type=float, help="relative, for the FMU's solver")
    parser.add_argument("--hold", action="store_true", help="hold the torque from row to row")
    parser.add_argument("--columns", default=",".join(COLUMNS), metavar="NAME,…")
    args = parser.parse_args()
    try:
        ending_of(args.out)
        if args.out.exists() and args.input.exists() and args.out.samefile(args.input):
            raise FmuError(f"{args.out} is not written: it is the input {args.input}")
        torque = read_table(args.input, ["time", TORQUE])
        answer = drive(
            args.fmu, torque["time"], torque[TORQUE], dict(args.settings),
            tolerance=args.tolerance, hold=args.hold, columns=args.columns.split(","),
        )  # fmt: skip
        write_table(args.out, answer)
    except FmuError as error:
        sys.exit(f"error: {error}")
    print(f"{len(answer['time'])} rows in {args.out}")


if __name__ == "__main__":
    main()
