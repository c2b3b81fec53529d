"""Program under mpiexec: runs several cases one after the other in the same ranks, which start only once. A JSON file
has the arguments of the runs: a list of lists of arguments of the worker.
"""

import json
import sys
from pathlib import Path

from conoid.worker.run.main import main

if __name__ == "__main__":
    codes = [main(arguments) for arguments in json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))]
    sys.exit(max(codes))
