"""How does schema 3 become schema 4? A link says by what it was made, and has the label of its hypothesis.

Labels were numbered in the order in which links began, so they are known of older runs too; what was weighed is not.
"""

from alembic import op

revision, down_revision = "4", "3"

STATEMENTS = (
    "ALTER TABLE links ADD COLUMN label TEXT NOT NULL DEFAULT ''",
    "ALTER TABLE links ADD COLUMN score_nats FLOAT",
    "ALTER TABLE links ADD COLUMN margin_nats FLOAT",
    "ALTER TABLE links ADD COLUMN runner_up TEXT NOT NULL DEFAULT ''",
    "ALTER TABLE links ADD COLUMN hidden_us BIGINT",
    """WITH begun AS (SELECT run_no, number, row_number() OVER (PARTITION BY run_no ORDER BY number) AS place
        FROM links WHERE kind IN ('established', 'reestablished'))
    UPDATE links SET label = lower || '->' || upper || '#' || begun.place
        FROM begun WHERE links.run_no = begun.run_no AND links.number = begun.number""",
)


def upgrade() -> None:
    """Change the tables."""
    for statement in STATEMENTS:
        op.execute(statement)
