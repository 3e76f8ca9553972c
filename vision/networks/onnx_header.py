"""What does an ONNX file say about itself? Its operator set and the shape of its input.

A network that is fed a picture of another size may answer nonsense without a word, so the size is read from the file.
ONNX files are protocol buffers; only the few fields on the way to these two are looked at (onnx.proto of the ONNX
project: ModelProto.graph = 7, .opset_import = 8; GraphProto.initializer = 5, .input = 11; and so on).
"""

from collections.abc import Iterator
from dataclasses import dataclass

MAX_VARINT_BITS = 64
MAX_SIZE = 1 << 31
_VARINT, _FIXED64, _CHUNK, _FIXED32 = 0, 1, 2, 5

Field = tuple[int, int | bytes]


@dataclass(frozen=True, slots=True)
class OnnxHeader:
    """The outside of a network.

    Attributes
    ----------
    opset : version of the standard operator set; 0 if the file does not say.
    input_name : of the picture.
    input_shape : sizes of its axes; 0 where the file leaves one open.
    """

    opset: int
    input_name: str
    input_shape: tuple[int, ...]


def read_header(data: bytes) -> OnnxHeader:
    """Read the header of an ONNX file.

    Parameters
    ----------
    data : the whole file.

    Raises
    ------
    ValueError
        If it is no ONNX file, or one without exactly one input.
    """
    model = list(_fields(data))
    graphs = _chunks(model, 7)
    if len(graphs) != 1:
        raise ValueError(f"{len(data)} bytes without a graph")
    graph = list(_fields(graphs[0]))
    weights = {_text(_fields(one), 8) for one in _chunks(graph, 5)}
    inputs = [one for one in _chunks(graph, 11) if _text(_fields(one), 1) not in weights]
    if len(inputs) != 1:
        raise ValueError(f"{len(inputs)} inputs")
    opsets = [list(_fields(one)) for one in _chunks(model, 8)]
    standard = [one for one in opsets if _text(iter(one), 1) in ("", "ai.onnx")]
    opset = _number(standard[0], 2) if standard else 0
    return OnnxHeader(opset, _text(_fields(inputs[0]), 1), _shape(inputs[0]))


def _shape(value_info: bytes) -> tuple[int, ...]:
    """Follow ValueInfoProto.type (2) .tensor_type (1) .shape (2) .dim (1) .dim_value (1)."""
    level = [value_info]
    for field in (2, 1, 2, 1):
        level = [chunk for one in level for chunk in _chunks(list(_fields(one)), field)]
    sizes = (_number(list(_fields(one)), 1) for one in level)
    # Exporters write -1 for an axis of any size, which reads as a very large unsigned number.
    return tuple(size if size <= MAX_SIZE else 0 for size in sizes)


def _chunks(fields: list[Field], number: int) -> list[bytes]:
    return [value for field, value in fields if field == number and isinstance(value, bytes)]


def _number(fields: list[Field], number: int) -> int:
    return next((value for field, value in fields if field == number and isinstance(value, int)), 0)


def _text(fields: Iterator[Field], number: int) -> str:
    found = next((value for field, value in fields if field == number and isinstance(value, bytes)), b"")
    return found.decode("utf-8", "replace")


def _fields(data: bytes) -> Iterator[Field]:
    """Walk over the fields of one message; the contents of long fields are given as they stand."""
    place = 0
    while place < len(data):
        key, place = _varint(data, place)
        field, kind = key >> 3, key & 7
        if kind == _VARINT:
            value, place = _varint(data, place)
            yield field, value
            continue
        if kind == _CHUNK:
            size, place = _varint(data, place)
        elif kind in (_FIXED64, _FIXED32):
            size = 8 if kind == _FIXED64 else 4
        else:
            raise ValueError(f"a field of kind {kind} at byte {place}")
        if place + size > len(data):
            raise ValueError(f"a field that goes {place + size - len(data)} bytes past the end")
        yield field, data[place : place + size]
        place += size


def _varint(data: bytes, place: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, MAX_VARINT_BITS, 7):
        if place >= len(data):
            raise ValueError("an end in the middle of a number")
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, place
    raise ValueError(f"a number of more than {MAX_VARINT_BITS} bits at byte {place}")
