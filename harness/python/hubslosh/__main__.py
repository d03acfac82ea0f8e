"""Runs a command of the program ``hubslosh``, whose folder need not be on PATH.

python -m hubslosh run --input torque.csv --out answer.csv --set slosh.model=spherical
"""

import subprocess
import sys

from .command import find_program
from .fmu import FmuError


def main() -> None:
    """Run the program with the arguments of ``python -m hubslosh``, and end with its exit code."""
    try:
        sys.exit(subprocess.run([find_program(), *sys.argv[1:]], check=False).returncode)
    except FmuError as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
