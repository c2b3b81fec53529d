"""The last values of probes are columns of the table of a sweep."""

import math

from conoid.cases.outcome import Measured, Outcome, from_json, to_json
from conoid.server.routes.sweeps import _results


def test_probes_are_columns_with_units_and_empty_where_they_are_no_number() -> None:
    probes = [Measured(name="v", value=412.5, unit="m/s"), Measured(name="hole", value=math.nan, unit="m")]
    ended = from_json(to_json(Outcome(state="succeeded", probes=probes)))
    found = _results(ended)
    assert (found["probe.v [m/s]"], found["probe.hole [m]"]) == (412.5, "")
