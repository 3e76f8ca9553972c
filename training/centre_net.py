"""Which network? Vehicles as points with a size (Zhou et al. 2019, "Objects as Points"), on strides 4 to 32.

We depart from the paper: a plain pyramid of 3 x 3 convolutions instead of a large backbone, one heat map for all
classes (what is a vehicle is learnt from all of them), the class beside it, sizes as logarithms, the axis as a double
angle.
"""

from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

STRIDE = 4
DEEPEST = 32
"""An input is a multiple of this both ways."""
HEADS = {"heat": 1, "offset": 2, "size": 2, "class": 5}
AXIS = {"axis": 2}
CANDIDATES = 200
_WIDTHS = (8, 24, 40, 64, 96)
_RARE = -4.0
"""Log odds of a vehicle before anything is learnt: most places hold none."""


def _layer(inputs: int, outputs: int, side: int = 3, stride: int = 1) -> nn.Sequential:
    convolution = nn.Conv2d(inputs, outputs, side, stride, side // 2, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


class _Residual(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.first, self.second = _layer(width, width), _layer(width, width)[:2]

    def forward(self, x: Tensor) -> Tensor:
        return functional.relu(x + self.second(self.first(x)))


class CentreNet(nn.Module):
    """Pictures (n, 3, h, w), red first, 0 to 1, to one map of all heads, (n, channels, h / 4, w / 4).

    Parameters
    ----------
    is_oriented : add the axis of each vehicle.
    """

    def __init__(self, *, is_oriented: bool) -> None:
        super().__init__()
        self.heads = {**HEADS, **(AXIS if is_oriented else {})}
        half, quarter, eighth, sixteenth, deepest = _WIDTHS
        self.stem = nn.Sequential(_layer(3, half, stride=2), _layer(half, quarter, stride=2))
        self.eighth = nn.Sequential(_layer(quarter, eighth, stride=2), _layer(eighth, eighth))
        self.sixteenth = nn.Sequential(_layer(eighth, sixteenth, stride=2), _Residual(sixteenth))
        self.deepest = nn.Sequential(_layer(sixteenth, deepest, stride=2), _Residual(deepest))
        steps = ((deepest, sixteenth, sixteenth), (sixteenth, eighth, eighth), (eighth, quarter, 2 * quarter))
        self.sideways = nn.ModuleList([_layer(coarse, fine, 1) for coarse, fine, _ in steps])
        self.merged = nn.ModuleList([_layer(fine, wide) for _, fine, wide in steps])
        self.out = nn.Conv2d(2 * quarter, sum(self.heads.values()), 1)
        nn.init.constant_(self.out.bias, 0.0)
        nn.init.constant_(self.out.bias[:1], _RARE)  # type: ignore[index]

    def forward(self, pictures: Tensor) -> Tensor:
        """Compute the maps."""
        quarter = self.stem(pictures)
        eighth = self.eighth(quarter)
        sixteenth = self.sixteenth(eighth)
        x = self.deepest(sixteenth)
        for finer, sideways, merged in zip((sixteenth, eighth, quarter), self.sideways, self.merged, strict=True):
            x = merged(finer + functional.interpolate(sideways(x), scale_factor=2.0, mode="nearest"))
        return self.out(x)


class Decoded(nn.Module):
    """A network that ends in the rows of `vision.networks.onnx.output`: of one picture, the best 200 peaks.

    Parameters
    ----------
    network : trained.
    """

    def __init__(self, network: CentreNet) -> None:
        super().__init__()
        self.network = network.eval()

    def forward(self, pictures: Tensor) -> Tensor:
        """Compute the rows of one picture, (200, 6 or 7)."""
        maps = self.network(pictures)
        columns = maps.shape[3]
        heat = torch.sigmoid(maps[:, :1])
        is_peak = heat == functional.max_pool2d(heat, 3, 1, 1)
        scores, places = torch.topk((heat * is_peak.to(heat.dtype)).flatten(), CANDIDATES)
        chosen = maps[0].flatten(1).index_select(1, places).t()
        parts = dict(zip(self.network.heads, chosen.split(list(self.network.heads.values()), 1), strict=True))
        # Pixels count from their centres: the first cell reaches from -0.5 to 3.5.
        corner = torch.stack([places % columns, places // columns], 1).to(maps.dtype)
        centre = STRIDE * (corner + parts["offset"]) - 0.5
        size = STRIDE * torch.exp(parts["size"])
        kind = parts["class"].argmax(1, keepdim=True).to(maps.dtype)
        if "axis" not in parts:
            return torch.cat([centre - size / 2, centre + size / 2, scores[:, None], kind], 1)
        angle = torch.atan2(parts["axis"][:, 1:], parts["axis"][:, :1]) / 2
        return torch.cat([centre, size, scores[:, None], kind, angle], 1)


def loss_of(maps: Tensor, target: Tensor, heads: dict[str, int]) -> tuple[Tensor, Tensor]:
    """Measure how wrong maps are.

    Parameters
    ----------
    maps : (n, channels, h, w), of the network.
    target : (n, 2 + channels, h, w), see `training.targets`.
    heads : of the network.

    Returns
    -------
    Loss of the heat map (focal, for each vehicle) and of what is told at the vehicles.
    """
    heat, believed, told = target[:, :1], target[:, 1:2], target[:, 2:3]
    logits = maps[:, :1]
    score = torch.sigmoid(logits)
    is_centre = heat == 1
    count = is_centre.sum().clamp(min=1)
    hit = (1 - score) ** 2 * functional.logsigmoid(logits) * is_centre
    miss = (1 - heat) ** 4 * score**2 * functional.logsigmoid(-logits) * believed * ~is_centre
    heat_loss = -(hit + miss).sum() / count
    place = told / told.sum().clamp(min=1)
    wanted = target[:, 3:]
    kind = 1 + HEADS["offset"] + HEADS["size"]
    geometry = (maps[:, 1:kind] - wanted[:, : kind - 1]).abs().mul(place).sum()
    classes = functional.cross_entropy(maps[:, kind : kind + 5], wanted[:, kind - 1].long(), reduction="none")
    geometry = geometry + (classes[:, None] * place).sum()
    if "axis" in heads:
        geometry = geometry + (maps[:, kind + 5 :] - wanted[:, kind:]).abs().mul(place).sum()
    return heat_loss, geometry


def write_onnx(network: CentreNet, path: Path) -> None:
    """Write a trained network, decoding included, for pictures of any height and width."""
    whole = Decoded(network)
    axes = {"pictures": {2: "height", 3: "width"}, "rows": {0: "candidates"}}
    example = torch.zeros(1, 3, 2 * DEEPEST * 4, 3 * DEEPEST * 4)
    torch.onnx.export(
        whole, (example,), str(path), input_names=["pictures"], output_names=["rows"], dynamic_axes=axes,
        opset_version=17, dynamo=False,
    )  # fmt: skip
