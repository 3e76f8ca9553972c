"""`dyknow demo`, shortened."""

from tests.conftest import Demo


def test_demo_prints_recognised_overtakes_beside_the_truth(demo: Demo) -> None:
    assert "overtakes sim" in demo.printed
    assert "recall    1.000" in demo.printed
    assert "x real time" in demo.printed
    assert "curl 'http://127.0.0.1:8420/api/v1/events?type=overtake&limit=3'" in demo.printed
    assert demo.log.exists()
