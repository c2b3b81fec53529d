"""Program that writes a report: ``python -m conoid.client.reports FOLDER OUT`` reads the run in a folder. The server
makes reports with this program.
"""

import sys
from pathlib import Path

from ..errors import ClientError
from ..result import Result
from .report import write


def main(folder: str, out: str) -> int:
    """Writes a report; returns the exit code: 0, or 1 after it has printed one line with the error."""
    try:
        write(Result.open(folder), Path(out))
    except ClientError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
