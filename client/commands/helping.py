"""Help of the command line: commands in groups, and examples for each command."""

import typer
from typer.core import TyperCommand, TyperGroup

GROUPS: dict[str, tuple[str, ...]] = {
    "Cases and meshes": ("cases", "validate", "import", "schema", "materials"),
    "Run": ("demo", "run", "submit", "batch", "restart"),
    "Follow and steer": ("runs", "ls", "show", "watch", "cancel", "checkpoint", "snapshot"),
    "Look at results": ("view", "figures", "report", "get", "replay-balance"),
    "Compare": ("compare", "sweep", "sweep-table", "sweep-plot", "sweep-cancel", "converge"),
    "Server": ("serve",),
    "Measure Conoid itself": ("bench", "hard"),
}
"""Commands grouped by purpose, in the order in which a user needs them."""
EXAMPLES: dict[str, tuple[str, ...]] = {
    "cases": ("conoid cases", "conoid cases copy taylor_copper"),
    "validate": ("conoid validate my_case.toml", "conoid validate demo --set run.end_time='20 us'"),
    "import": ("conoid import bar.k", "conoid import model.inp --units mm,t,s --out case"),
    "schema": ("conoid schema --out case.schema.json", "conoid schema --page --out keys.md"),
    "materials": ("conoid materials", "conoid materials alumina"),
    "demo": ("conoid demo", "conoid demo --out glass.png"),
    "run": ("conoid run demo --view bar.png", "conoid run my_case.toml --set run.end_time='20 us' --check"),
    "submit": ("conoid submit my_case.toml --label batch=first", "conoid submit demo --ranks 4 --threads 2"),
    "batch": ("conoid batch my_case.toml --ranks 16",),
    "restart": ("conoid restart last --ranks 4", "conoid restart last --max-steps 20000"),
    "runs": ("conoid runs --case 'glass*' --since 3d", "conoid runs failed --label batch=first --limit 100"),
    "ls": ("conoid ls --state running",),
    "show": ("conoid show last", "conoid show runs/local/RUN --json"),
    "watch": ("conoid watch last", "conoid watch runs/local/RUN --plain"),
    "cancel": ("conoid cancel last",),
    "checkpoint": ("conoid checkpoint last",),
    "snapshot": ("conoid snapshot last",),
    "view": (
        "conoid view last --field temperature --out hot.png",
        "conoid view last --section y=0.001 --camera=-y --out all.gif",
    ),
    "figures": ("conoid figures energy last energy.png", "conoid figures history last history.png"),
    "report": ("conoid report last", "conoid report runs/local/RUN --out run.html"),
    "get": ("conoid get last --out here", "conoid get last history.csv outcome.json"),
    "replay-balance": ("conoid replay-balance last",),
    "compare": ("conoid compare RUN OTHER", "conoid compare RUN OTHER --out both.png"),
    "sweep": (
        "conoid sweep my_case.toml --set 'parts[0].velocity[2]=-200 m/s,-300 m/s' --wait",
        "conoid sweep my_case.toml --set run.ranks=1,2 --set run.threads=1,2 --grid --local",
        "conoid sweep my_case.toml --adaptive 'probe.left = 0'",
        "    --set 'parts[0].velocity[2]=-200:-800 m/s' --tolerance '5 m/s'",
    ),
    "sweep-table": ("conoid sweep-table last --out sweep.csv", "conoid sweep-table runs/local/sweeps/SWEEP.json"),
    "sweep-plot": ("conoid sweep-plot last --out sweep.png --column probe.left",),
    "sweep-cancel": ("conoid sweep-cancel last",),
    "converge": ("conoid converge my_case.toml --out study", "conoid converge demo --meshes 2,1.414,1"),
    "bench": ("conoid bench --help",),
    "hard": ("conoid hard",),
}
"""Examples for the help of each command, one text line each. A line that begins with blanks continues the line
before."""


class Grouped(TyperGroup):
    """The group of all commands. GROUPS gives the order of the list of commands, and EXAMPLES the examples in the
    help of a command.
    """

    def format_commands(self, ctx: typer.Context, formatter: object) -> None:  # type: ignore[override]
        """Writes the list of commands; commands without a group are last."""
        there = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        named = {name for names in GROUPS.values() for name in names}
        groups = {**GROUPS, "More": tuple(name for name in there if name not in named)}
        width = max(map(len, there), default=0)
        for title, names in groups.items():
            rows = [
                (name.ljust(width), command.get_short_help_str(limit=200))
                for name in names
                if (command := there.get(name)) is not None and not command.hidden
            ]
            if rows:
                with formatter.section(title):  # type: ignore[attr-defined]
                    formatter.write_dl(rows)  # type: ignore[attr-defined]

    def get_command(self, ctx: typer.Context, cmd_name: str) -> TyperCommand | None:  # type: ignore[override]
        """Returns a command whose help ends with its examples."""
        command = super().get_command(ctx, cmd_name)
        if command is not None and cmd_name in EXAMPLES and not command.epilog:
            lines = "\n".join(f"  {line}" for line in EXAMPLES[cmd_name])
            command.epilog = f"\b\nExamples:\n{lines}"
        return command  # type: ignore[return-value]
