"""Places in texts, marked by `<<` and `>>`."""


def place_of(marked: str) -> tuple[str, int, int, int]:
    """Take the marks out of a text; give it with line, column and end column of the marked place."""
    start = marked.index("<<")
    end = marked.index(">>") - 2
    text = marked.replace("<<", "").replace(">>", "")
    line_start = text.rfind("\n", 0, start) + 1
    return text, text.count("\n", 0, start) + 1, start - line_start + 1, end - line_start + 1
