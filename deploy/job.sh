#!/bin/bash
# One attempt of a run, written by Conoid: $1 is the run's folder, $2 the name of the job. The rest is in job.json.
module load gcc/13.2
export HYDRA_IFACE=ib0
exec /opt/conoid/bin/python -m conoid.worker.job "$1" "$2"
