"""Slurm's commands as scripts: what is queued is a file."""

from pathlib import Path

SBATCH = """#!/bin/bash
for word in "$@"; do case "$word" in --job-name=*) name="${{word#--job-name=}}";; esac; done
cd {place}; echo called >> calls
{body}
"""
SQUEUE = """#!/bin/bash
cd {place}; [ -e away ] && {{ echo "slurm_load_jobs error: Unable to contact slurm controller" >&2; exit 1; }}
cat queue 2>/dev/null; exit 0
"""
TELL = {"scancel": "ended", "scontrol": "released"}
"""Commands that write their words into a file."""
ACCEPT = 'echo "$((100 + $(wc -l < calls)))|PENDING|N/A|$name|Resources" >> queue'


def commands(place: Path, body: str) -> str:
    """An sbatch that does ``body``, and a squeue that tells what it has queued."""
    told = {name: f"#!/bin/bash\necho $@ >> {{place}}/{file}\n" for name, file in TELL.items()}
    for name, text in {"sbatch": SBATCH, "squeue": SQUEUE, **told}.items():
        path = place / "bin" / name
        path.write_text(text.format(place=place, body=body))
        path.chmod(0o755)
    return str(place / "bin")
