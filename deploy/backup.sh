#!/bin/sh
# Makes a backup of the server's database while the server runs: backup.sh DATABASE FILE
#   /opt/conoid/deploy/backup.sh /var/lib/conoid/runs/server.sqlite /backup/server.sqlite
# The copy is consistent, also during writes to the database. It replaces the previous copy when it is complete.
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
