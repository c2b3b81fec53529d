"""Commands that tell and draw what a run has said of itself."""

from pathlib import Path
from typing import Annotated

import typer

from conoid.cases.schema import Balance

from . import replay, tables
from .errors import ViewError
from .options import Json, SourceArgument, Token, Url, opened, show, show_json

figures = typer.Typer(no_args_is_help=True, help="Charts from what a run has told.")


@figures.command(name="balance")
def balance_figure(
    source: SourceArgument,
    out: Annotated[Path, typer.Argument(metavar="OUT.png", help="The PNG.")],
    url: Url = None,
    token: Token = None,
) -> None:
    """Draw the outside nodes of each rank with the cuts, and where the CPU time went."""
    try:
        from . import charts
    except ModuleNotFoundError as error:
        raise ViewError(f"charts need the extra 'view' of conoid: {error}") from None
    with opened(source, url, token) as result:
        name = str(result.case["name"])
        charts.balance(charts.course(result.messages), f"{name}, {result.folder.name}", name, out)
    typer.echo(out)


def replay_balance(
    source: SourceArgument,
    policy: Annotated[
        str | None,
        typer.Option("--policy", help="measured, outside, every, every:N or never; the run's own if not given."),
    ] = None,
    alpha: Annotated[float | None, typer.Option("--alpha", help="Of the policy 'outside'.")] = None,
    ranks: Annotated[int | None, typer.Option("--ranks", min=1, help="Ranks; those of the run if not given.")] = None,
    cost: Annotated[
        float | None, typer.Option("--cost", min=0.0, help="Of a cut, s; what the run has measured if not given.")
    ] = None,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Tell what other balance policies would have cost and saved, from the loads that a run has told."""
    with opened(source, url, token) as result:
        spec = Balance.model_validate(result.case.get("balance", {}))
        record = replay.read(result.messages, replay.named(spec))
        x, y, z = result.case["run"].get("cut_scale", (1.0, 1.0, 1.0))
    other, each = replay.chosen(spec, policy or spec.policy, alpha), record.cost if cost is None else cost
    accounts = replay.compare(record, other, ranks or record.happened.ranks, each, (x, y, z))
    if as_json:
        show_json({"policies": accounts, "run": record.happened, "cost": each, "heaviest_group": record.heaviest})
        return
    show(tables.balance_table(accounts, record.happened))
    typer.echo(
        f"on {accounts[0].ranks} ranks, the run had {record.happened.ranks}; a cut costs {each:.3g} s; "
        f"{len(record.moments)} moments, {len(record.centres)} groups, "
        f"of which the heaviest has {record.heaviest:.1%} of the work"
    )
