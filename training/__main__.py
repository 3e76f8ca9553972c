"""Make one of the networks from nothing: `python -m training above|low OUT [--steps N] [--batch N]`.

OUT gets the worlds, the weights and the ONNX file; what is there already is not made again.
"""

import argparse
import os
from pathlib import Path

import torch

from training.centre_net import write_onnx
from training.crops import LOOKS
from training.score import score
from training.train import train
from training.worlds import write_worlds

TRAINED_ON, CHOSEN_ON = range(10_000, 10_540), range(1, 6)


def main() -> None:
    """Render, train, write and score."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=sorted(LOOKS))
    parser.add_argument("out", type=Path)
    parser.add_argument("--steps", type=int, default=12_000)
    parser.add_argument("--batch", type=int, help="crops a step; default: that of the kind, which goes with --steps")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes that render")
    parser.add_argument("--still", type=Path, help="folder of the real still, to score on")
    given = parser.parse_args()
    # On a graphics card the way back through what is enlarged has no deterministic form.
    torch.use_deterministic_algorithms(not torch.cuda.is_available())
    worlds, check = (given.out / f"{given.kind}-{use}" for use in ("worlds", "check"))
    for folder, seeds in ((worlds, TRAINED_ON), (check, CHOSEN_ON)):
        if not (folder / "boxes.npz").exists():
            write_worlds(folder, given.kind, seeds, is_plain=folder == check, workers=given.workers)
    batch = given.batch or LOOKS[given.kind].batch
    weights = given.out / f"{given.kind}.pt"
    network = train([worlds], given.kind, weights, steps=given.steps, batch=batch)
    write_onnx(network, given.out / f"{given.kind}.onnx")
    score(given.out / f"{given.kind}.onnx", check, still_folder=given.still)


if __name__ == "__main__":
    main()
