"""How does schema 4 become schema 5? Events, relation changes and links say how sure they are.

Of older links the margin is known, and with it the confidence; of events and relation changes nothing was said.
"""

import math

from alembic import op

revision, down_revision = "5", "4"

STATEMENTS = (
    "ALTER TABLE events ADD COLUMN confidence FLOAT NOT NULL DEFAULT 1.0",
    "ALTER TABLE relations ADD COLUMN confidence FLOAT NOT NULL DEFAULT 1.0",
    "ALTER TABLE links ADD COLUMN confidence FLOAT NOT NULL DEFAULT 1.0",
    "UPDATE links SET confidence = round(1 / (1 + exp(-margin_nats)), 3) WHERE margin_nats IS NOT NULL",
)


def upgrade() -> None:
    """Change the tables."""
    database = op.get_bind().connection.driver_connection
    assert database is not None
    database.create_function("exp", 1, math.exp)  # not every SQLite has it
    for statement in STATEMENTS:
        op.execute(statement)
