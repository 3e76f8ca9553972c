"""Does a car that is hidden come back? Until that is known, it is a hypothesis that it does not."""

from collections.abc import Collection, Mapping


class Absences:
    """Keep a label for every car that is hidden, used once.

    Attributes
    ----------
    labels : of the cars that are hidden now.

    Examples
    --------
    >>> absences = Absences()
    >>> absences.judge({"car7": 1_000_000, "car8": 1_200_000}, ())
    ((('car7 lost#1', 1000000), ('car8 lost#2', 1200000)), (), ())
    >>> absences.judge({"car8": 1_200_000}, ["car7"])              # car7 is back
    ((), (), ('car7 lost#1',))
    >>> absences.judge({}, ["car7"])                               # car8 will never be
    ((), ('car8 lost#2',), ())
    """

    def __init__(self) -> None:
        self._count = 0
        self.labels: Mapping[str, str] = {}

    def judge(
        self, hidden: Mapping[str, int], cars: Collection[str]
    ) -> tuple[tuple[tuple[str, int], ...], tuple[str, ...], tuple[str, ...]]:
        """Take who is hidden in a frame, and since when, and who is there.

        Returns
        -------
        Labels that are new, with the time from which on the car is absent; those validated; and those refuted.
        """
        decided = [(car, label) for car, label in self.labels.items() if car not in hidden]
        new = [car for car in hidden if car not in self.labels]
        labels = {car: label for car, label in self.labels.items() if car in hidden}
        for number, car in enumerate(new, start=self._count + 1):
            labels[car] = f"{car} lost#{number}"
        self._count += len(new)
        self.labels = labels
        opened = tuple((labels[car], hidden[car]) for car in new)
        back = {car for car, _ in decided}.intersection(cars)
        validated = tuple(label for car, label in decided if car not in back)
        return opened, validated, tuple(label for car, label in decided if car in back)
