"""The first seconds of a video that is there already: its own pictures, which nobody draws or encodes again."""

from pathlib import Path

import av


def first_seconds(video: Path, out: Path, seconds: float) -> Path:
    """Copy the packets of a video of `dyknow generate` (no picture of it needs a later one); returns the new file."""
    with av.open(str(video)) as source, av.open(str(out), "w") as target:
        shown = source.streams.video[0]
        stream = target.add_stream_from_template(shown)
        for packet in source.demux(shown):
            if packet.pts is not None and packet.pts * packet.time_base < seconds:
                packet.stream = stream
                target.mux(packet)
    return out
