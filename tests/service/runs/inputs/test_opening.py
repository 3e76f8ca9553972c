"""Inputs, chronicle files and the shipped examples."""

from pathlib import Path

import pytest

from chronicles import library
from chronicles.errors import ChronicleError
from service.errors import InputError
from service.runs.inputs.input_kind import Asked, content_digest
from service.runs.inputs.opening import open_input
from service.runs.inputs.sites.site import load_site
from service.texts.chronicle_files import load_chronicle_files

EXAMPLES = Path(__file__).parents[4] / "examples"


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_site_file_loads(path: Path) -> None:
    site = load_site(path)
    assert site.camera is not None
    assert site.network is not None


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.chronicle")), ids=lambda path: path.stem)
def test_shipped_chronicle_loads(path: Path) -> None:
    assert path.stem in load_chronicle_files([path]).merged.names


def test_no_chronicle_file_means_the_whole_library() -> None:
    assert load_chronicle_files([]).merged.names == library.load_library().names


def test_log_remembers_text_version_and_parameters_of_a_chronicle() -> None:
    (record,) = load_chronicle_files([EXAMPLES / "follow.chronicle"]).records
    assert record.parameters == ("follower", "leader")
    assert "hold(behind[?follower, ?leader]:true" in record.text
    assert len(record.version) == 12


def test_errors_of_several_files_are_reported_together(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.chronicle").write_text(f"chronicle {name}[?x](t1) {{ event(no_{name}[?x], t1) }}")
    with pytest.raises(ChronicleError) as caught:
        load_chronicle_files([tmp_path / "a.chronicle", tmp_path / "b.chronicle"])
    assert {Path(one.file).stem for one in caught.value.diagnostics} == {"a", "b"}


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "No such file"), (b"\xff\xfe", "expected UTF-8 text, got byte 0xff")],
    ids=["missing", "binary"],
)
def test_chronicle_file_that_cannot_be_read(tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "mine.chronicle"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        load_chronicle_files([path])


def test_column_map_for_a_video_is_refused(tmp_path: Path) -> None:
    video = tmp_path / "video.mp4"
    video.write_bytes(b"x")
    with pytest.raises(InputError, match=r"expected a .csv or .jsonl file to go with a column map, got '.mp4'"):
        open_input(Asked(video, columns={"t_s": "t"}))


def test_digest_depends_on_the_bytes_alone(tmp_path: Path) -> None:
    for name, content in (("a", b"same"), ("b", b"same"), ("c", b"other")):
        (tmp_path / name).write_bytes(content)
    digests = {name: content_digest(tmp_path / name) for name in "abc"}
    assert digests["a"] == digests["b"] != digests["c"]
