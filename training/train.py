"""How are weights found? By steps down the loss over crops of rendered worlds."""

from pathlib import Path

import cv2
import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from training.augment import LOOKS, Look, crop_of, mask_of, repainted, spoilt
from training.centre_net import CentreNet, loss_of
from training.clutter import scatter
from training.targets import target_maps

_EVERY = 250
_RATE = 2e-3
"""Highest learning rate, after the first twelfth of the steps; it falls to nothing at the end."""


class Crops(Dataset[tuple[torch.Tensor, torch.Tensor]]):
    """Crops of rendered pictures: the same number gives the same crop.

    Parameters
    ----------
    folders : as `training.worlds.write_worlds` leaves them.
    look : of the crops.
    count : of crops.
    """

    def __init__(self, folders: list[Path], look: Look, count: int) -> None:
        self._frames = [np.load(folder / "frames.npy", mmap_mode="r") for folder in folders]
        self._boxes = [np.load(folder / "boxes.npz") for folder in folders]
        self._boxes = [[boxes[str(nth)] for nth in range(len(boxes.files))] for boxes in self._boxes]
        self._look, self._count = look, count

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, number: int) -> tuple[torch.Tensor, torch.Tensor]:
        rng = np.random.default_rng((7, number))
        folder = rng.integers(len(self._frames))
        nth = rng.integers(len(self._boxes[folder]))
        side = self._look.crop_px
        crop, boxes, is_ignored = crop_of(self._frames[folder][nth], self._boxes[folder][nth], self._look, rng)
        scatter(crop, rng, count=min(30, int(rng.exponential(4))), kept=mask_of(boxes, crop.shape[:2]))
        crop = spoilt(repainted(crop, boxes, rng), rng)
        target = target_maps(boxes, is_ignored, (side, side), is_oriented=self._look.is_oriented)
        planes = np.ascontiguousarray(crop[:, :, ::-1].transpose(2, 0, 1), np.float32) / np.float32(255)
        return torch.from_numpy(planes), torch.from_numpy(target)


def train(
    folders: list[Path],
    kind: str,
    out: Path,
    *,
    steps: int,
    batch: int,
    workers: int = 1,
) -> CentreNet:
    """Train, and write the running mean of the weights now and then, and at the end.

    It takes a graphics card (CUDA) where there is one, else the processor.

    Parameters
    ----------
    folders : rendered worlds.
    kind : of `LOOKS`.
    out : weights.
    steps, batch : how many steps, and crops a step.
    workers : how many processes make crops; the crops do not depend on it.

    Returns
    -------
    The network with the mean weights, on the processor.
    """
    torch.manual_seed(1)
    look = LOOKS[kind]
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    network = CentreNet(is_oriented=look.is_oriented)
    network = network.to(device, memory_format=torch.channels_last)
    mean = torch.optim.swa_utils.AveragedModel(network, avg_fn=_running_mean, use_buffers=True)
    optimiser = torch.optim.AdamW(network.parameters(), _RATE, weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, _RATE, steps, pct_start=0.08)
    crops = DataLoader(
        Crops(folders, look, steps * batch), batch, num_workers=workers, prefetch_factor=4, worker_init_fn=_alone
    )
    seen = torch.zeros(2, device=device)
    for step, (pictures, target) in enumerate(crops, start=1):
        maps = network(pictures.to(device, memory_format=torch.channels_last))
        heat, told = loss_of(maps, target.to(device), network.heads)
        optimiser.zero_grad()
        (heat + told).backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 10.0)
        optimiser.step()
        schedule.step()
        mean.update_parameters(network)
        seen += torch.stack((heat, told)).detach()
        if step % _EVERY == 0 or step == steps:
            torch.save(mean.module.state_dict(), out)
            print("step {}: heat {:.3f}, told {:.3f}".format(step, *(seen / _EVERY).tolist()), flush=True)
            seen.zero_()
    return mean.module.cpu()


def _alone(_: int) -> None:
    """Let a process that makes crops have one thread: there are as many of them as cores."""
    cv2.setNumThreads(0)


def _running_mean(mean: torch.Tensor, now: torch.Tensor, count: torch.Tensor | int) -> torch.Tensor:
    """Keep the mean of some 300 steps, of fewer at the start: what was drawn at random counts no longer then."""
    kept = min(0.997, (1 + int(count)) / (10 + int(count)))
    return kept * mean + (1 - kept) * now
