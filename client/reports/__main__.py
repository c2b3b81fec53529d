"""``python -m conoid.client.reports FOLDER OUT``: the report of the run in a folder, as a server has it made."""

import sys
from pathlib import Path

from ..errors import ClientError
from ..result import Result
from .report import write


def main(folder: str, out: str) -> int:
    """0, or 1 with one line of what is wrong."""
    try:
        write(Result.open(folder), Path(out))
    except ClientError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
