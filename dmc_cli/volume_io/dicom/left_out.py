"""Tell in a message what was left out."""

MOST_NAMED = 3
"""Things that a message names of those that were left out; the rest it counts."""


def left_out(names: list[str], one: str, many: str) -> list[str]:
    """Return a sentence on things of one kind that were left out, or none where there are none.

    Args:
        names: Their names.
        one: What a single one is.
        many: The same of several.
    """
    if not names:
        return []
    kind = f"1 {one} was" if len(names) == 1 else f"{len(names)} {many} were"
    return [f"{kind} left out: {shortened(names, ', ')}"]


def shortened(names: list[str], separator: str) -> str:
    """Return the first names, and how many more there are."""
    told = separator.join(names[:MOST_NAMED])
    return f"{told} and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else told
