"""How does schema 10 become schema 11? A job may be a live source."""

import sqlalchemy as sa
from alembic import op

revision, down_revision = "11", "10"


def upgrade() -> None:
    """Add the kind of a job; all so far are runs over files."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("kind", sa.Text, nullable=False, server_default="run"))
    with op.batch_alter_table("jobs") as jobs:  # what comes from now on says what it is
        jobs.alter_column("kind", server_default=None)
