"""Which process comes before which? Each reads others, and there are no cycles."""

from collections.abc import Iterator, Mapping

from dyknow.streams.process import Process


def inputs_first(processes: Mapping[str, Process]) -> tuple[Process, ...]:
    """Sort processes so that each comes after what it reads, and otherwise as they are.

    The order of creation is not enough: a mediation may read what was created after it.
    """
    ordered: dict[str, Process] = {}
    # One iterator for each process that waits for its inputs; not a recursive function, for chains may be long.
    waiting: list[tuple[Process | None, Iterator[Process]]] = [(None, iter(processes.values()))]
    while waiting:
        process, inputs = waiting[-1]
        one = next((found for found in inputs if found.label not in ordered), None)
        if one is not None:
            waiting.append((one, _read_by(one, processes)))
        else:
            waiting.pop()
            if process is not None:
                ordered[process.label] = process
    return tuple(ordered.values())


def depends_on(processes: Mapping[str, Process], label: str, other: str) -> bool:
    """Tell whether a process is another one, reads it, or reads what depends on it."""
    waiting, seen = [processes[label]], {label}
    while waiting:
        current = waiting.pop()
        if current.label == other:
            return True
        found = [one for one in _read_by(current, processes) if one.label not in seen]
        seen.update(one.label for one in found)
        waiting += found
    return False


def _read_by(process: Process, processes: Mapping[str, Process]) -> Iterator[Process]:
    """Give the processes whose streams a process reads, but for those that are just being removed."""
    return (processes[one.stream.label] for one in process.inputs if one.stream.label in processes)
