"""Name the files and entries of an input that no volume was made of."""

MOST_NAMED = 3
"""How many names a message lists; of the others it gives the number."""


def left_out(names: list[str], one: str, many: str) -> list[str]:
    """Return one sentence that names the files of one kind that were left out; no sentence if there are none.

    Args:
        names: Of the files.
        one: What one of them is called, such as `damaged file`.
        many: The plural of it.
    """
    if not names:
        return []
    kind = f"1 {one} was" if len(names) == 1 else f"{len(names)} {many} were"
    return [f"{kind} left out: {shortened(names, ', ')}"]


def shortened(names: list[str], separator: str) -> str:
    """Return the first `MOST_NAMED` names, and how many more there are."""
    told = separator.join(names[:MOST_NAMED])
    return f"{told} and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else told
