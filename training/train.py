"""How are weights found? By steps down the loss over crops of rendered worlds."""

import time
from pathlib import Path

import torch

from training.centre_net import CentreNet, loss_of
from training.crops import LOOKS, crops_of, load_pictures
from training.spoil import clutter_layers, spoilt
from training.targets import target_maps

_EVERY = 250
_RATE = 2e-3
"""Highest learning rate, after the first twelfth of the steps; it falls to nothing at the end."""
_LAYERS = 1000


def train(folders: list[Path], kind: str, out: Path, *, steps: int, batch: int) -> CentreNet:
    """Train, and write the running mean of the weights now and then, and at the end.

    It takes a graphics card (CUDA) where there is one, which also makes the crops, else the processor.

    Parameters
    ----------
    folders : rendered worlds.
    kind : of `LOOKS`.
    out : weights.
    steps, batch : how many steps, and crops a step.

    Returns
    -------
    The network with the mean weights, on the processor.
    """
    torch.manual_seed(1)
    torch.backends.cudnn.benchmark = True
    look = LOOKS[kind]
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    rng = torch.Generator(device).manual_seed(7)
    pictures, layers = load_pictures(folders, device), clutter_layers(_LAYERS, look.crop_px).to(device)
    network = CentreNet(is_oriented=look.is_oriented)
    network = network.to(device, memory_format=torch.channels_last)
    mean = torch.optim.swa_utils.AveragedModel(network, avg_fn=_running_mean, use_buffers=True)
    optimiser = torch.optim.AdamW(network.parameters(), _RATE, weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, _RATE, steps, pct_start=0.08)
    seen, since_s = torch.zeros(2, device=device), time.perf_counter()
    for step in range(1, steps + 1):
        with torch.no_grad():
            crops, boxes, is_ignored = crops_of(pictures, look, batch, rng)
            crops = spoilt(crops, boxes, layers, rng).contiguous(memory_format=torch.channels_last)
            target = target_maps(boxes, is_ignored, (look.crop_px,) * 2, is_oriented=look.is_oriented)
        with torch.autocast(device.type, torch.bfloat16, enabled=device.type == "cuda"):
            maps = network(crops)
        heat, told = loss_of(maps.float(), target, network.heads)
        optimiser.zero_grad()
        (heat + told).backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 10.0)
        optimiser.step()
        schedule.step()
        mean.update_parameters(network)
        seen += torch.stack((heat, told)).detach()
        if step % _EVERY == 0 or step == steps:
            torch.save(mean.module.state_dict(), out)
            lost = (seen / ((step - 1) % _EVERY + 1)).tolist()
            elapsed_s = time.perf_counter() - since_s
            print("step {}: heat {:.3f}, told {:.3f}, {:.0f} s".format(step, *lost, elapsed_s), flush=True)
            seen.zero_()
    return mean.module.cpu()


def _running_mean(mean: torch.Tensor, now: torch.Tensor, count: torch.Tensor | int) -> torch.Tensor:
    """Keep the mean of some 300 steps, of fewer at the start: what was drawn at random counts no longer then."""
    kept = min(0.997, (1 + int(count)) / (10 + int(count)))
    return kept * mean + (1 - kept) * now
