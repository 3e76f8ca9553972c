"""How does schema 5 become schema 6? Events that were taken back, or are not sure enough, have an index."""

from alembic import op

revision, down_revision = "6", "5"

STATEMENT = "CREATE INDEX events_by_status ON events (status, start_us, seq) WHERE status IN ('retracted', 'doubtful')"


def upgrade() -> None:
    """Make the index."""
    op.execute(STATEMENT)
