"""Fake commands of Slurm as shell scripts. A file contains the queue of the fake Slurm."""

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
"""Fake Slurm commands that append their arguments to a file."""
ACCEPT = 'echo "$((100 + $(wc -l < calls)))|PENDING|N/A|$name|Resources" >> queue'


def commands(place: Path, body: str) -> str:
    """Writes an sbatch that runs ``body``, and a squeue that prints the queued jobs."""
    scripts = {name: f"#!/bin/bash\necho $@ >> {{place}}/{file}\n" for name, file in TELL.items()}
    for name, text in {"sbatch": SBATCH, "squeue": SQUEUE, **scripts}.items():
        path = place / "bin" / name
        path.write_text(text.format(place=place, body=body))
        path.chmod(0o755)
    return str(place / "bin")
