"""Builders of small trajectory files."""

from pathlib import Path

HEADER = "t_us,id,x_m,y_m,heading_rad,speed_mps,length_m,width_m"


def write_tracks(path: Path, *, frames: int) -> Path:
    """Write one car that drives east at 10 m/s, ten times a second."""
    rows = [f"{100_000 * frame},a,{frame}.0,0.0,0.0,10.0,4.5,1.8" for frame in range(frames)]
    path.write_text("\n".join([HEADER, *rows, ""]))
    return path


def write_row(path: Path, **fields: str) -> Path:
    """Write one row, with some of its fields replaced."""
    values = dict(zip(HEADER.split(","), ("0", "a", "1.0", "2.0", "0.0", "10.0", "4.5", "1.8"), strict=True)) | fields
    path.write_text(f"{HEADER}\n{','.join(values.values())}\n")
    return path
