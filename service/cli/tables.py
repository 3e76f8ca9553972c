"""How does a table look on a terminal, and in a pipe?

Plain columns, two blanks apart, as wide as their widest cell: no frames, no colours, nothing cut off.
"""

from collections.abc import Sequence


def format_table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lay out rows under titles; the text ends with a newline.

    Examples
    --------
    >>> print(format_table(["type", "road"], [["overtake", "road1"], ["pass", ""]]), end="")
    type      road
    overtake  road1
    pass
    """
    lines = [titles, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(titles))]
    padded = ("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in lines)
    return "".join(f"{line.rstrip()}\n" for line in padded)
