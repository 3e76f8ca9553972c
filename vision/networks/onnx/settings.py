"""How does a network want its pictures, and what do its numbers mean? Its recipe, the TOML beside the weights.

A file of weights does not say whether it takes red or blue first, which of its classes are vehicles, or which of its
columns is the score. `traffic.toml` beside `traffic.onnx` does; docs/detectors.md lists the fields.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from msgspec import Meta

from vision.networks.box_detector import CLASS_NAMES

Layout = Literal["yolo", "yolo-oriented", "rows", "rows-oriented"]
Colours = Literal["rgb", "bgr", "grey"]
Provider = Literal["cpu", "cuda", "openvino"]

_Share = Annotated[float, Meta(ge=0, le=1)]
_Finite = Annotated[float, Meta(ge=-1e300, le=1e300, description="a finite number")]
_Above0 = Annotated[float, Meta(gt=0, le=1e300, description="a number above 0")]
_InputPx = Annotated[int, Meta(ge=1, le=8192)]
_Tiles = Annotated[int, Meta(ge=1, le=16)]
_Threads = Annotated[int, Meta(ge=1, le=64)]
_PROVIDERS = f"a list out of {', '.join(get_args(Provider))}, the preferred one first"
_Number = Annotated[int, Meta(ge=0)]
_Word = Annotated[str, Meta(pattern=rf"^({'|'.join(CLASS_NAMES)})\Z")]
CLASSES = f'a table such as {{ "2" = "car" }} with words out of {", ".join(CLASS_NAMES)}'
ClassWords = Annotated[Mapping[_Number, _Word], Meta(min_length=1, description=CLASSES)]


@dataclass(frozen=True, slots=True)
class OnnxSettings:
    """What must be known about a network besides its weights.

    Attributes
    ----------
    layout : of the output. ``yolo``: (4 + classes, n), columns x, y, width, height and a score for each class;
        ``yolo-oriented``: the same with the angle as last row; ``rows``: (n, 6) left, top, right, bottom, score, class;
        ``rows-oriented``: (n, 7) x, y, width, height, score, class, angle. A first axis of 1 may stand before each.
    classes : number of the network's class to our word (`CLASS_NAMES`); what is not listed is no vehicle.
    input_size_px : (width, height); None to take them from the weights.
    enlarge : how many times larger, at most, weights that take any size see a picture that is smaller than that.
    closer : how many times larger they see the far part of a road once more, if the camera stands; 1 for not at all.
    closer_below_px : far vehicles are those of which the longer side is shorter than this in the input.
    score_threshold : boxes with a lower score are dropped, but
    weak_threshold : those with at least this score count where a vehicle is expected, which has been seen before; None
        for none.
    edge_noise_share : standard deviation of a box's edges, as a part of its size, at score 0 and at score 1: who is
        sure of a vehicle knows better where it ends.
    nms_threshold : of two boxes that share more than this part of their union, the one with the lower score goes.
    max_candidates : no more boxes, those of the best scores, are compared with each other; a good network gives a few
        hundred.
    colours : order of the input's planes.
    scale, mean, deviation : the input is (value * scale - mean) / deviation, values from 0 to 255.
    tiles : (columns, rows) into which the picture is cut, each of which is looked at by itself.
    overlap : part of a tile that it shares with the next one; at least the longest vehicle should fit.
    max_batch : no more tiles are computed at once, where the weights take any number: each wants memory, 80 MB in a
        network for 512 x 512 px.
    output : name of the output, for a network with several.
    providers : what may compute the network, the preferred one first; what is not installed is passed over.
    threads : of the processor. One, since looks come a few times a second beside decoding and tracking, which want the
        other cores: at 512 x 512 px a second thread cost 1.3 times the processor time a look, and busy cores gave none.
    licence, source : in words, for who installs it; empty where the recipe does not say.
    """

    layout: Layout
    classes: ClassWords
    input_size_px: Annotated[tuple[_InputPx, _InputPx], Meta(description="1 to 8192, twice")] | None = None
    enlarge: Annotated[float, Meta(ge=1, le=8)] = 8.0
    closer: Annotated[float, Meta(ge=1, le=8)] = 1.0
    closer_below_px: _Above0 = 30.0
    score_threshold: _Share = 0.25
    weak_threshold: _Share | None = None
    edge_noise_share: Annotated[tuple[_Share, _Share], Meta(description="two shares, at score 0 and 1")] = (0.1, 0.1)
    nms_threshold: _Share = 0.5
    max_candidates: Annotated[int, Meta(ge=1)] = 2000
    colours: Colours = "rgb"
    scale: _Finite = 1 / 255
    mean: _Finite = 0.0
    deviation: _Above0 = 1.0
    tiles: Annotated[tuple[_Tiles, _Tiles], Meta(description="columns and rows from 1 to 16")] = (1, 1)
    overlap: Annotated[float, Meta(ge=0, le=0.9)] = 0.2
    max_batch: _Tiles = 8
    output: str = ""
    providers: Annotated[tuple[Provider, ...], Meta(min_length=1, description=_PROVIDERS)] = ("cpu",)
    threads: _Threads = 1
    licence: str = ""
    source: str = ""

    @property
    def least_score(self) -> float:
        """The score below which a box counts nowhere."""
        return self.score_threshold if self.weak_threshold is None else min(self.weak_threshold, self.score_threshold)
