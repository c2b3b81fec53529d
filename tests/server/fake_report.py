"""Test program in place of the program that makes reports. The title of the run's case selects the behaviour of the
program.
"""

import sys
import time
from pathlib import Path

folder, out = map(Path, sys.argv[1:])
does = (folder / "case.toml").read_text().split('title = "')[1].split('"')[0]
if does == "hangs":
    time.sleep(60)
if does == "eats":
    rows = [bytearray(1 << 26) for _ in range(100)]
if does == "writes":
    out.with_name(f".{out.name}.part").write_bytes(bytes(1 << 26))
if does == "fails":
    sys.exit("mesh: no frame\nno frame can be read")
out.write_text(f"<!doctype html>{time.monotonic()}")
