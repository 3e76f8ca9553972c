"""How does schema 5 become schema 6? Hidden events, and what became of the links on trial, have indexes."""

from alembic import op

revision, down_revision = "6", "5"

STATEMENTS = (
    "CREATE INDEX events_by_status ON events (status, start_us, seq) WHERE status IN ('retracted', 'doubtful')",
    "CREATE INDEX hypotheses_by_label ON hypotheses (run_no, label)",
)


def upgrade() -> None:
    """Make the indexes."""
    for statement in STATEMENTS:
        op.execute(statement)
