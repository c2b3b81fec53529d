"""Tables of the server's database for SQLAlchemy. The module ``store`` reads and writes the tables."""

import sqlalchemy as sa

META = sa.MetaData()
"""Metadata of all tables."""
RUNS = sa.Table(
    "runs",
    META,
    sa.Column("id", sa.String(22), primary_key=True),
    sa.Column("owner", sa.String(64), nullable=False),
    sa.Column("name", sa.String(64), nullable=False),
    sa.Column("ranks", sa.Integer, nullable=False),
    sa.Column("submitted", sa.Float(53), nullable=False),
    sa.Column("state", sa.String(16), nullable=False),
    sa.Column("cause", sa.String(16)),
    sa.Column("message", sa.Text, nullable=False),
    sa.Column("started", sa.Float(53), nullable=False),
    sa.Column("finished", sa.Float(53), nullable=False),
    sa.Column("stopping_for", sa.String(16)),
    sa.Column("threads", sa.Integer, nullable=False, server_default="1"),
    sa.Column("title", sa.Text, nullable=False, server_default=""),
    sa.Index("runs_of_owner", "owner", "id"),
    sa.Index("runs_by_state", "state"),
)
"""Table of runs: every accepted run, in the state that was last saved."""
KEYS = sa.Table(
    "idempotency",
    META,
    sa.Column("owner", sa.String(64), nullable=False),
    sa.Column("key", sa.String(255), nullable=False),
    sa.Column("run", sa.String(22), nullable=False),
    sa.UniqueConstraint("owner", "key"),
)
"""Table of idempotency keys: for each owner and key, the run that was made with the key."""
LABELS = sa.Table(
    "labels",
    META,
    sa.Column("run", sa.String(22), nullable=False),
    sa.Column("name", sa.String(63), nullable=False),
    sa.Column("owner", sa.String(64), nullable=False),
    sa.Column("value", sa.String(200), nullable=False),
    sa.PrimaryKeyConstraint("run", "name"),
    sa.Index("runs_of_label", "owner", "name", "value", "run"),
)
"""Table of the labels of runs."""
CARDS = sa.Table(
    "cards",
    META,
    sa.Column("run", sa.String(22), primary_key=True),
    sa.Column("form", sa.Integer, nullable=False),
    sa.Column("final", sa.Boolean, nullable=False),
    sa.Column("body", sa.LargeBinary, nullable=False),
)
"""Table of the cards of runs (card.py); the cards can be made again from the folders of the runs."""
BONDS = sa.Table(
    "bond",
    META,
    sa.Column("number", sa.Integer, primary_key=True),
    sa.Column("server", sa.String(64), nullable=False),
    sa.Column("place", sa.Text, nullable=False),
)
"""Table with one row: the server and the folder of runs to which this database belongs."""
TOKENS = sa.Table(
    "tokens",
    META,
    sa.Column("id", sa.String(16), primary_key=True),
    sa.Column("owner", sa.String(64), nullable=False),
    sa.Column("sha256", sa.String(64), nullable=False),
    sa.Column("scopes", sa.String(64), nullable=False),
    sa.Column("created", sa.Float(53), nullable=False),
    sa.Column("revoked", sa.Boolean, nullable=False),
)
"""Table of tokens; the key is the hash of the token."""
