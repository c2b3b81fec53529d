#!/bin/bash
# One attempt of a run, written by Conoid: $1 is its folder or that of its array, $2 the job's name. See job.json there.
module load gcc/13.2
export HYDRA_IFACE=ib0
exec /opt/conoid/bin/python -P -m conoid.worker.run.job "$1" "$2"
