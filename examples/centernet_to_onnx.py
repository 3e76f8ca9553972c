"""Make a detector for `dyknow detector add` out of the CenterNet in the npm package @vladmandic/human 3.3.6.

Fetch the package with `npm pack @vladmandic/human@3.3.6`, install `onnx` (it comes with `dyknow[train]`), then

    python examples/centernet_to_onnx.py vladmandic-human-3.3.6.tgz centernet.onnx

writes centernet.onnx and its recipe centernet.toml. The network is CenterNet on MobileNetV3, trained on COCO: two
million weights, stored as a graph of TensorFlow.js. Its layers are translated one to one. Its tail, which picks the 100
best peaks of the heat map, is written anew with the same arithmetic, so that it takes several pictures in one go.
"""

import json
import sys
import tarfile
from base64 import b64decode, b64encode
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import onnx
from onnx.helper import make_graph, make_model, make_node, make_opsetid, make_tensor_value_info

LICENCE = "MIT for the package; none stated at 610265158/mobilenetv3_centernet, where the weights come from"
RECIPE = f"""\
licence = "{LICENCE}"
source = "models/centernet in the npm package @vladmandic/human 3.3.6"
layout = "rows"
classes = {{ "2" = "car", "3" = "motorcycle", "5" = "bus", "7" = "truck" }}   # numbers of COCO
colours = "rgb"
scale = 1.0                    # the network takes 0 to 255
score_threshold = 0.25
"""
HEAT, SIDES = "tower_0/keypoints", "tower_0/wh"  # (n, 80, 128, 128) scores; (n, 4, 128, 128) left, top, right, bottom
SIZE_PX, CELL_PX, CELLS, PEAKS = 512, 4, 128, 100
OPSET = 13

Weights = Mapping[str, np.ndarray]
Input = str | float | list[int] | np.ndarray


class Graph:
    """Collects the nodes and weights of an ONNX graph; pictures are (n, channels, height, width) in it."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.weights: dict[str, np.ndarray] = {}

    def add(self, kind: str, inputs: Iterable[Input], output: str, **attributes: object) -> str:
        """Append a node; an input that is no name becomes a constant."""
        names = [one if isinstance(one, str) else self.constant(one) for one in inputs]
        self.nodes.append(make_node(kind, names, [output], output, **attributes))
        return output

    def constant(self, value: Input) -> str:
        """Store a constant: numbers with a point as float32, whole ones as int64."""
        array = np.asarray(value)
        name = f"constant_{len(self.weights)}"
        self.weights[name] = array.astype(np.float32 if array.dtype.kind == "f" else np.int64)
        return name


def read_package(path: Path) -> tuple[list[dict], Weights]:
    """Read the graph and its weights, kept as float16, out of the package."""
    try:
        with tarfile.open(path) as package:
            graph = json.load(package.extractfile("package/models/centernet.json"))
            data = package.extractfile("package/models/centernet.bin").read()
    except (OSError, KeyError, tarfile.TarError) as error:
        raise SystemExit(f"{path}: expected @vladmandic/human 3.3.6 as `npm pack` gives it, got {error}") from error
    weights, offset = {}, 0
    for entry in graph["weightsManifest"][0]["weights"]:
        kind = np.dtype(entry.get("quantization", entry)["dtype"])
        count = int(np.prod(entry["shape"]))
        weights[entry["name"]] = np.frombuffer(data, kind, count, offset).reshape(entry["shape"])
        offset += count * kind.itemsize
    return graph["modelTopology"]["node"], weights


def add_layer(graph: Graph, layer: dict, weights: Weights) -> None:
    """Translate one layer; TensorFlow keeps the channels last, ONNX first."""
    kind, name = layer["op"], layer["name"]
    inputs = [one for one in layer["input"] if one not in weights]
    values = [weights[one] for one in layer["input"] if one in weights]
    if "conv2d" in kind.lower():
        add_convolution(graph, layer, inputs, values)
    elif kind in ("Add", "Mul"):
        graph.add(kind, [*inputs, *values], name)
    elif kind in ("Relu", "Sigmoid", "Identity"):
        graph.add(kind, inputs, name)
    elif kind == "Relu6":
        graph.add("Clip", [*inputs, 0.0, 6.0], name)
    elif kind == "Mean":
        graph.add("ReduceMean", inputs, name, axes=[2, 3], keepdims=1)
    elif kind == "ConcatV2":
        graph.add("Concat", inputs, name, axis=1)
    elif kind == "ResizeBilinear":
        how = {"mode": "linear", "coordinate_transformation_mode": "asymmetric"}
        graph.add("Resize", [*inputs, "", np.array([1.0, 1.0, 2.0, 2.0])], name, **how)
    else:
        raise SystemExit(f"layer {name}: expected one that @vladmandic/human 3.3.6 has, got {kind}")


def add_convolution(graph: Graph, layer: dict, inputs: list[str], values: list[np.ndarray]) -> None:
    """Translate a convolution with what TensorFlow has fused into it: the bias, and cutting off at 0."""
    name, said, is_depthwise = layer["name"], layer["attr"], "Depthwise" in layer["op"]
    kernel = values[0].transpose((2, 3, 0, 1) if is_depthwise else (3, 2, 0, 1))
    has_relu = b64encode(b"Relu").decode() in said.get("fused_ops", {}).get("list", {}).get("s", [])
    graph.add(
        "Conv",
        [*inputs, kernel, *values[1:]],
        f"{name}/linear" if has_relu else name,
        group=len(kernel) if is_depthwise else 1,
        strides=[int(step) for step in said["strides"]["list"]["i"][1:3]],
        auto_pad="SAME_UPPER" if b64decode(said["padding"]["s"]) == b"SAME" else "VALID",
    )
    if has_relu:
        graph.add("Relu", [f"{name}/linear"], name)


def add_tail(graph: Graph) -> str:
    """Turn the best peaks of the heat map into rows of left, top, right, bottom, score, class in pixels."""
    add = graph.add
    add("MaxPool", [HEAT], "highest", kernel_shape=[3, 3], strides=[1, 1], pads=[1, 1, 1, 1])
    add("Cast", [add("Equal", [HEAT, "highest"], "is_peak")], "peak", to=onnx.TensorProto.FLOAT)
    add("Reshape", [add("Mul", [HEAT, "peak"], "peaks"), [0, -1]], "flat")
    graph.nodes.append(make_node("TopK", ["flat", graph.constant([PEAKS])], ["score", "index"], axis=1))
    cells = CELLS * CELLS
    add("Div", ["index", cells], "class")
    add("Mod", ["index", cells], "cell")
    add("Mod", ["cell", CELLS], "column")
    add("Div", ["cell", CELLS], "row")
    for name in ("class", "column", "row"):
        add("Cast", [name], f"{name}_float", to=onnx.TensorProto.FLOAT)
    add("Unsqueeze", ["cell", [1]], "cell_of_side")
    add("Concat", ["cell_of_side"] * 4, "cells_of_sides", axis=1)
    add("Reshape", [SIDES, [0, 4, -1]], "sides_flat")
    add("GatherElements", ["sides_flat", "cells_of_sides"], "sides", axis=2)
    for number, side in enumerate(("left", "top", "right", "bottom")):
        add("Mul", [("column_float", "row_float")[number % 2], float(CELL_PX)], f"{side}_from")
        add("Gather", ["sides", number], f"{side}_length", axis=1)
        add("Sub" if number < 2 else "Add", [f"{side}_from", f"{side}_length"], side)
    names = ("left", "top", "right", "bottom", "score", "class_float")
    return add("Concat", [add("Unsqueeze", [one, [2]], f"{one}_column") for one in names], "rows", axis=2)


def convert(package: Path, out: Path) -> None:
    """Write the network and its recipe."""
    layers, weights = read_package(package)
    graph = Graph()
    for layer in layers:
        if layer["op"] not in ("Const", "Placeholder"):
            add_layer(graph, layer, weights)
        if layer["name"] == SIDES:
            break
    rows = add_tail(graph)
    made = make_graph(
        graph.nodes,
        "centernet",
        [make_tensor_value_info("tower_0/images", onnx.TensorProto.FLOAT, ["n", 3, SIZE_PX, SIZE_PX])],
        [make_tensor_value_info(rows, onnx.TensorProto.FLOAT, ["n", PEAKS, 6])],
        [onnx.numpy_helper.from_array(array, name) for name, array in graph.weights.items()],
    )
    model = make_model(made, opset_imports=[make_opsetid("", OPSET)], ir_version=8)
    onnx.checker.check_model(model)
    onnx.save(model, out)
    out.with_suffix(".toml").write_text(RECIPE)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(f"usage: {sys.argv[0]} PACKAGE.tgz OUT.onnx")
    print(f"licence: {LICENCE}\nWhether you may use them is yours to find out; do not pass them on.", file=sys.stderr)
    convert(Path(sys.argv[1]), Path(sys.argv[2]))
