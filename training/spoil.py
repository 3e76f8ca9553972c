"""How is a rendered picture made to look like one of a camera nobody knows? Repainted, littered, lit, blurred, packed.

Rendered pictures are too clean: edges too sharp, areas too even, colours few. Each fault of a real camera is drawn by
itself, so that no two crops have the same ones.
"""

import math

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from training.clutter import scatter
from training.crops import Boxes

_LAYERS_A_CROP = 6
_REPAINTED = 4
_COARSE = 4
_KERNEL_REACH_PX = 6
_LUMA = (0.299, 0.587, 0.114)


class Chances:
    """Draw numbers for each of some crops.

    Parameters
    ----------
    count : of crops.
    rng : source of every choice.
    """

    def __init__(self, count: int, rng: torch.Generator) -> None:
        self.count, self.rng = count, rng

    def happens(self, chance: float) -> Tensor:
        """Tell for which crops, (n, 1, 1, 1)."""
        return self.uniform(0, 1) < chance

    def uniform(self, low: float, high: float, planes: int = 1) -> Tensor:
        """Draw evenly, (n, planes, 1, 1)."""
        drawn = torch.rand(self.count, planes, 1, 1, generator=self.rng, device=self.rng.device)
        return low + (high - low) * drawn

    def normal(self, *shape: int) -> Tensor:
        """Draw with mean 0 and deviation 1, (n, *shape)."""
        return torch.randn(self.count, *shape, generator=self.rng, device=self.rng.device)

    def noise(self, side: int, cell_px: Tensor) -> Tensor:
        """Draw smooth noise, (n, 1, side, side), whose waves are so many pixels long, (n, 1, 1, 1), 1.5 or more."""
        cells = math.ceil(side / 1.5)
        pixel = torch.arange(side, device=self.rng.device) / cell_px.reshape(-1, 1)
        x = (2 * pixel + 1) / cells - 1
        grid = torch.stack([x[:, None].expand(-1, side, -1), x[:, :, None].expand(-1, -1, side)], 3)
        return functional.grid_sample(self.normal(1, cells, cells), grid, mode="bicubic", align_corners=False)


def clutter_layers(count: int, side: int) -> Tensor:
    """Draw bundles of shapes that are no vehicles, (count, 4, side, side): colours, red first, times cover; cover."""
    layers = np.zeros((count, side, side, 4), np.uint8)
    for nth in range(count):
        black, white = np.zeros((side, side, 3), np.uint8), np.full((side, side, 3), 255, np.uint8)
        for canvas in (black, white):
            scatter(canvas, np.random.default_rng((11, nth)), count=1)
        layers[nth, :, :, :3], layers[nth, :, :, 3] = black[:, :, ::-1], 255 - (white - black).min(axis=2)
    return torch.from_numpy(layers).permute(0, 3, 1, 2)


def spoilt(crops: Tensor, boxes: Boxes, layers: Tensor, rng: torch.Generator) -> Tensor:
    """Make crops look like those of some camera.

    Parameters
    ----------
    crops : (n, 3, side, side), red first, 0 to 1.
    boxes : of the vehicles in them.
    layers : of `clutter_layers`.
    rng : source of every choice, on the crops' device.

    Returns
    -------
    As the crops.
    """
    chances = Chances(len(crops), rng)
    littered = cluttered(crops, boxes, layers, chances)
    painted = _repainted(littered, boxes, chances)
    return _packed(_blurred(_lit(painted, chances), chances), chances)


def cluttered(crops: Tensor, boxes: Boxes, layers: Tensor, chances: Chances) -> Tensor:
    """Lay bundles of shapes on crops, turned and scaled; one that reaches into a vehicle is left out."""
    side = crops.shape[2]
    grown = boxes.rows + torch.tensor([0, 0, 2 * _COARSE, 2 * _COARSE, 0, 0, 0], device=crops.device)
    is_vehicle = (inside(grown, side, _COARSE) & boxes.is_box[:, :, None, None]).any(1, keepdim=True)
    wanted = (-4 * torch.log(chances.uniform(1e-6, 1))).floor()  # mostly few
    for nth in range(_LAYERS_A_CROP):
        chosen = torch.randint(len(layers), (len(crops),), generator=chances.rng, device=layers.device)
        angle_rad, scale = chances.uniform(-math.pi, math.pi), torch.exp(chances.uniform(-0.7, 0.4))
        cos, sin = torch.cos(angle_rad) / scale, torch.sin(angle_rad) / scale
        shift = chances.uniform(-1, 1, 2)
        placed = torch.stack([torch.stack([cos, -sin, shift[:, :1]], 4), torch.stack([sin, cos, shift[:, 1:]], 4)], 3)
        grid = functional.affine_grid(placed.reshape(-1, 2, 3), [len(crops), 4, side, side], align_corners=False)
        layer = functional.grid_sample(layers[chosen].float() / 255, grid, align_corners=False)
        is_painted = functional.max_pool2d(layer[:, 3:], _COARSE) > 0
        is_laid = (wanted > nth) & ~(is_painted & is_vehicle).flatten(1).any(1)[:, None, None, None]
        crops = torch.where(is_laid, crops * (1 - layer[:, 3:]) + layer[:, :3], crops)
    return crops


def _repainted(crops: Tensor, boxes: Boxes, chances: Chances) -> Tensor:
    """Give a few vehicles another colour, and a shine: most paints are not in the palette."""
    side, order = crops.shape[2], torch.rand(boxes.is_box.shape, generator=chances.rng, device=crops.device)
    chosen = boxes.select((order * boxes.is_box).argsort(1, descending=True)[:, :_REPAINTED])
    rows = chosen.rows * torch.tensor([1, 1, 0.94, 0.9, 1, 1, 1], device=crops.device)
    for box, is_vehicle in zip(rows.split(1, 1), chosen.is_box.split(1, 1), strict=True):
        part = crops * chances.uniform(0.55, 1.35, 3) + chances.uniform(-0.1, 0.16)
        # What shines in paint and glass: the sky, trees, other vehicles.
        cell_px = box[:, :, 2:4].amin(2)[:, :, None, None] * chances.uniform(0.15, 0.8)
        shine = chances.noise(side, cell_px.clamp(min=1.5)) * chances.uniform(0.05, 0.4) * chances.happens(0.6)
        is_changed = inside(box, side) & is_vehicle[:, :, None, None] & chances.happens(0.6)
        crops = torch.where(is_changed, part * torch.exp(shine), crops)
    return crops.clamp(0, 1)


def inside(boxes: Tensor, side: int, step_px: int = 1) -> Tensor:
    """Tell which pixels lie in boxes, (n, k, 7): (n, k, side, side), or of every so manieth the middle of so many."""
    pixel = torch.arange(side // step_px, device=boxes.device) * step_px + (step_px - 1) / 2
    x, y, length, width, angle_rad = (one[:, :, None, None] for one in boxes[:, :, :5].unbind(2))
    away_x, away_y = pixel - x, pixel[:, None] - y
    along = away_x * torch.cos(angle_rad) + away_y * torch.sin(angle_rad)
    across = away_y * torch.cos(angle_rad) - away_x * torch.sin(angle_rad)
    return (along.abs() < length / 2) & (across.abs() < width / 2)


def _lit(crops: Tensor, chances: Chances) -> Tensor:
    """Change colours, light and contrast, patches of shade included."""
    side = crops.shape[2]
    order = chances.uniform(0, 1, 3).argsort(1).expand_as(crops)
    crops = torch.where(chances.happens(0.3), crops.gather(1, order), crops)
    grey = _grey(crops, (0.3, 0.4, 0.3))
    crops = grey + chances.uniform(0.2, 1.4) * ~chances.happens(0.15) * (crops - grey)
    # Shade and light in large patches, as of clouds, walls and haze.
    light = chances.uniform(0.1, 0.4) * chances.noise(side, chances.uniform(20, 200)) * chances.happens(0.3)
    crops = (crops * torch.exp(light)).clamp(0, 1) ** torch.exp(0.35 * chances.normal(1, 1, 1))
    gain = torch.exp(0.3 * chances.normal(1, 1, 1) - 0.15) * chances.uniform(0.88, 1.12, 3)
    crops = (crops - 0.5) * gain + 0.5 + 0.1 * chances.normal(1, 1, 1)
    grain = chances.noise(side, chances.uniform(1.5, 6))
    return crops + chances.uniform(0, 0.06) * chances.happens(0.3) * grain


def _blurred(crops: Tensor, chances: Chances) -> Tensor:
    """Take pixels away, blur, shake and sharpen."""
    side = crops.shape[2]
    parts = []
    for part in crops.split(math.ceil(len(crops) / 8)):  # fewer pixels than there are now
        smaller_px = round(side * float(0.35 + 0.6 * torch.rand(1, generator=chances.rng, device=crops.device)))
        small = functional.interpolate(part, size=smaller_px, mode="bilinear", antialias=True)
        parts.append(functional.interpolate(small, size=side, mode="bicubic"))
    crops = torch.where(chances.happens(0.4), torch.cat(parts), crops)
    crops = torch.where(chances.happens(0.6), smooth(crops, chances.uniform(0.3, 1.6)), crops)
    reach = torch.arange(-_KERNEL_REACH_PX, _KERNEL_REACH_PX + 1, device=crops.device)
    shake = (reach.abs() <= chances.uniform(0.5, 2.5)[:, :, 0]).float()
    still = (reach == 0).float().expand_as(shake)
    is_across = chances.happens(0.5)[:, :, 0]
    shaken = _convolved(crops, torch.where(is_across, shake, still), torch.where(is_across, still, shake))
    crops = torch.where(chances.happens(0.1), shaken, crops)
    # The sharpening of cheap cameras, halos included.
    halo = crops - smooth(crops, chances.uniform(0.7, 2))
    crops = crops + chances.uniform(0.3, 1.8) * chances.happens(0.4) * halo
    one, three = chances.normal(1, side, side), chances.normal(3, side, side)
    noise = torch.where(chances.happens(0.5), one, three)
    return (crops - 0.01 * torch.log(chances.uniform(1e-6, 1)) * noise).clamp(0, 1)


def smooth(crops: Tensor, deviation_px: Tensor) -> Tensor:
    """Blur each crop with a Gaussian kernel of its own deviation, (n, 1, 1, 1)."""
    reach = torch.arange(-_KERNEL_REACH_PX, _KERNEL_REACH_PX + 1, device=crops.device)
    kernel = torch.exp(-((reach / deviation_px[:, :, 0]) ** 2) / 2)
    return _convolved(crops, kernel, kernel)


def _convolved(crops: Tensor, across: Tensor, down: Tensor) -> Tensor:
    """Filter each crop with kernels of its own, (n, 1, taps), for rows and for columns."""
    count, planes, side = crops.shape[:3]
    across, down = (kernel / kernel.sum(2, keepdim=True) for kernel in (across, down))
    taps = across.repeat_interleave(planes, 0)[:, :, None], down.repeat_interleave(planes, 0)[:, :, :, None]
    as_one = functional.pad(crops.reshape(1, -1, side, side), (_KERNEL_REACH_PX,) * 4, mode="replicate")
    for kernel in taps:
        as_one = functional.conv2d(as_one, kernel, groups=count * planes)
    return as_one.reshape(crops.shape)


_QUANTA = (
    (16, 11, 10, 16, 24, 40, 51, 61), (12, 12, 14, 19, 26, 58, 60, 55), (14, 13, 16, 24, 40, 57, 69, 56),
    (14, 17, 22, 29, 51, 87, 80, 62), (18, 22, 37, 56, 68, 109, 103, 77), (24, 35, 55, 64, 81, 104, 113, 92),
    (49, 64, 78, 87, 103, 121, 120, 101), (72, 92, 95, 98, 112, 100, 103, 99),
)  # fmt: skip
_COLOUR_QUANTA = ((17, 18, 24, 47), (18, 21, 26, 66), (24, 26, 56, 99), (47, 66, 99, 99))
"""Of JPEG, ITU-T T.81, annex K; all other quanta of colour are 99."""


def _packed(crops: Tensor, chances: Chances) -> Tensor:
    """Compress seven in ten crops."""
    return torch.where(chances.happens(0.7), jpeg(crops, chances.uniform(20, 96).floor()), crops)


def jpeg(crops: Tensor, quality: Tensor) -> Tensor:
    """Round crops as JPEG does, colours at half the size; sides are multiples of 16.

    Parameters
    ----------
    crops : (n, 3, h, w), red first, 0 to 1.
    quality : (n, 1, 1, 1), 1 to 100, in the measure of libjpeg.
    """
    percent = torch.where(quality < 50, 5000 / quality, 200 - 2 * quality)
    light = torch.tensor(_QUANTA, device=crops.device)
    colour = torch.full((8, 8), 99, device=crops.device)
    colour[:4, :4] = torch.tensor(_COLOUR_QUANTA, device=crops.device)
    quanta = [((table * percent + 50) / 100).floor().clamp(1, 255) for table in (light, colour)]
    red, _, blue = crops.split(1, 1)
    grey = _grey(crops, _LUMA)
    halved = functional.avg_pool2d(torch.cat([(blue - grey) / 1.772, (red - grey) / 1.402], 1), 2)
    grey = _rounded(grey - 128 / 255, quanta[0]) + 128 / 255
    bluish, reddish = functional.interpolate(
        _rounded(halved, quanta[1]), scale_factor=2.0, mode="bilinear", align_corners=False
    ).split(1, 1)
    blue, red = grey + 1.772 * bluish, grey + 1.402 * reddish
    green = (grey - _LUMA[0] * red - _LUMA[2] * blue) / _LUMA[1]
    return torch.cat([red, green, blue], 1).clamp(0, 1)


def _rounded(planes: Tensor, quanta: Tensor) -> Tensor:
    """Round the cosine transforms of blocks of eight pixels to multiples of quanta, (n, 1, 8, 8)."""
    count, kinds, height, width = planes.shape
    place = torch.arange(8, device=planes.device, dtype=planes.dtype)
    basis = torch.cos((2 * place + 1) * place[:, None] * math.pi / 16) / 2
    basis[0] /= math.sqrt(2)
    blocks = planes.reshape(count, kinds, height // 8, 8, width // 8, 8).transpose(3, 4)
    quanta = quanta[:, :, None, None] / 255
    kept = ((basis @ blocks @ basis.T) / quanta).round() * quanta
    return (basis.T @ kept @ basis).transpose(3, 4).reshape(planes.shape)


def _grey(crops: Tensor, weights: tuple[float, float, float]) -> Tensor:
    return (crops * torch.tensor(weights, device=crops.device)[:, None, None]).sum(1, keepdim=True)
