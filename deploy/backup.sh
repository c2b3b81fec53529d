#!/bin/sh
# A backup of the server's database, beside a server that runs: backup.sh DATABASE FILE
#   /opt/conoid/deploy/backup.sh /var/lib/conoid/runs/server.sqlite /backup/server.sqlite
# The copy is whole, whatever is being written, and takes the place of the last one only when it is finished.
set -eu
umask 077
rm -f "$2.part"
"${PYTHON:-/opt/conoid/bin/python}" - "$1" "$2.part" <<'END'
import pathlib
import sqlite3
import sys

source, copy = sys.argv[1:]
with sqlite3.connect(f"{pathlib.Path(source).absolute().as_uri()}?mode=rw", uri=True, timeout=30.0) as database:
    database.execute("VACUUM INTO ?", (copy,))
END
mv "$2.part" "$2"
