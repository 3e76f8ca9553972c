"""Which things are connected? Those that have something in common, directly or by way of others."""

from collections.abc import Collection, Hashable, Iterable


def connected_components(keys_of: Iterable[Collection[Hashable]]) -> list[list[int]]:
    """Group things by what they have in common.

    Parameters
    ----------
    keys_of : what each thing has; one that has nothing is alone.

    Returns
    -------
    The groups, as places in the list of things.

    Examples
    --------
    >>> connected_components([{"a"}, {"b"}, {"c"}, {"a", "c"}, ()])
    [[1], [2, 0, 3], [4]]
    """
    groups: list[tuple[list[int], set[Hashable]]] = []
    for index, own in enumerate(keys_of):
        members, keys = [index], set(own)
        for group in [one for one in groups if not one[1].isdisjoint(own)]:
            groups.remove(group)
            members, keys = group[0] + members, group[1] | keys
        groups.append((members, keys))
    return [members for members, _ in groups]
