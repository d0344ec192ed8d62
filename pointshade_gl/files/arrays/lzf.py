"""Unpacks LZF (Lehmann 2000), the compression of PCD files: runs of bytes, and copies of what came before."""

from __future__ import annotations

_RUN = 32  # control bytes below are the length of a run, less 1
_MOST = 88  # times: three bytes give at most 264


def unpack(packed: bytes, size: int) -> bytes:
    """The `size` bytes that were packed. Raises ValueError if it gives another number, or is broken."""
    if size > _MOST * len(packed):
        raise ValueError(f"{len(packed)} packed bytes cannot give {size}")
    out, at, end, done = bytearray(size), 0, len(packed), 0
    try:
        while at < end:
            control = packed[at]
            at += 1
            if control < _RUN:
                after = at + control + 1
                out[done : done + control + 1] = packed[at:after]
                done, at = done + control + 1, after
                continue
            length = (control >> 5) + 2
            if length == 9:
                length += packed[at]
                at += 1
            start = done - ((control & 31) << 8) - packed[at] - 1
            at += 1
            if start < 0:
                raise ValueError("it copies from before its beginning")
            if start + length <= done:
                out[done : done + length] = out[start : start + length]
            else:  # it repeats what it writes
                period = out[start:done]
                out[done : done + length] = (period * (length // len(period) + 1))[:length]
            done += length
            if done > size:
                break
    except IndexError:
        raise ValueError("it ends in the middle of a copy") from None
    if done != size or len(out) != size or at > end:
        raise ValueError(f"it gives another number of bytes than {size}")
    return bytes(out)
