"""How does schema 2 become schema 3? A run knows the first time stamp of its video, and no table is missing.

Tables that came while the version stood at 2 are made where an older log lacks them.
"""

from alembic import op

revision, down_revision = "3", None

STATEMENTS = (
    "ALTER TABLE runs ADD COLUMN first_pts_us BIGINT",
    """CREATE TABLE IF NOT EXISTS seen_objects (
        run_no INTEGER NOT NULL, t_us BIGINT NOT NULL, vision_id TEXT NOT NULL,
        x_m FLOAT NOT NULL, y_m FLOAT NOT NULL, heading_rad FLOAT NOT NULL, length_m FLOAT NOT NULL,
        width_m FLOAT NOT NULL, observed BOOLEAN NOT NULL, clipped BOOLEAN NOT NULL,
        PRIMARY KEY (run_no, t_us, vision_id)) WITHOUT ROWID""",
    """CREATE TABLE IF NOT EXISTS views (
        run_no INTEGER NOT NULL, t_us BIGINT NOT NULL, pixel_from_ground TEXT NOT NULL,
        PRIMARY KEY (run_no, t_us)) WITHOUT ROWID""",
    """CREATE TABLE IF NOT EXISTS streams (
        run_no INTEGER NOT NULL, number INTEGER NOT NULL, body TEXT NOT NULL,
        PRIMARY KEY (run_no, number))""",
    """CREATE TABLE IF NOT EXISTS costs (
        run_no INTEGER NOT NULL, number INTEGER NOT NULL, label TEXT NOT NULL, busy_us BIGINT NOT NULL,
        PRIMARY KEY (run_no, number))""",
)


def upgrade() -> None:
    """Change the tables."""
    for statement in STATEMENTS:
        op.execute(statement)
