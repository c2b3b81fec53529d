"""``python -m conoid.client.reports FOLDER OUT`` writes the report of the run in a folder. The server makes reports
by this command.
"""

import sys
from pathlib import Path

from ..errors import ClientError
from ..result import Result
from .report import write


def main(folder: str, out: str) -> int:
    """Writes a report; returns the exit code: 0, or 1 after one line with the error."""
    try:
        write(Result.open(folder), Path(out))
    except ClientError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
