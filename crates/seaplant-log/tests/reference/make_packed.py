"""Packs a table with Python's gzip and zstandard in several ways, and damages it.

python3 make_packed.py FOLDER
"""

import gzip
import pathlib
import random
import sys
import zlib

import zstandard
from expected import Expected


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)
    dice = random.Random(4)
    rows = [(0.1 * k, dice.gauss(0, 1), 1500 + k % 400) for k in range(20_000)]
    text = "time [s],u [m/s],T1 (us)\n" + "".join(f"{t!r},{u!r},{p}\n" for t, u, p in rows)
    text = text.encode()

    def write(name, content, kept=rows):
        (folder / name).write_bytes(content)
        times, speeds, pulses = zip(*kept)
        expected.channel(name, "u [m/s]", times, speeds, unit="m/s")
        expected.channel(name, "T1 (us)", times, pulses, unit="us")

    packed = gzip.compress(text, 6)
    write("log.csv.gz", packed)
    half = len(text) // 2
    write("members.gz", gzip.compress(text[:half], 1) + gzip.compress(text[half:], 9))
    write("stored.gz", gzip.compress(text, 0))
    zstd = zstandard.ZstdCompressor(level=3, write_checksum=True, write_content_size=True)
    write("log.csv.zst", zstd.compress(text))
    write("frames.zst", zstd.compress(text[:half]) + zstd.compress(text[half:]))
    unsized = zstandard.ZstdCompressor(level=19, write_content_size=False)
    write("unsized.zst", unsized.compress(text))
    write("twice.zst.gz", gzip.compress(zstd.compress(text)))

    # What zlib unpacks of a truncated stream, up to the last complete line.
    cut = packed[: len(packed) // 3]
    whole = zlib.decompressobj(wbits=31).decompress(cut)
    lines = whole.count(b"\n") - 1
    write("cut.csv.gz", cut, rows[:lines])
    (folder / "cut.bytes").write_text(str(len(whole)))

    # The last eight bytes of a member are its checksum and its length.
    wrong = bytearray(packed)
    wrong[-8] ^= 1
    write("checksum.csv.gz", bytes(wrong))

    (folder / "bomb.gz").write_bytes(gzip.compress(b"t,u\n" + b"0,0\n" * 20_000_000, 9))
    (folder / "bomb.zst").write_bytes(zstd.compress(b"t,u\n" + b"0,0\n" * 20_000_000))
    seed = b"t,u\n" + b"".join(b"%d,%d\n" % (k, k * k) for k in range(300))
    (folder / "seed.gz").write_bytes(gzip.compress(seed))
    (folder / "seed.zst").write_bytes(zstd.compress(seed))
    expected.save()


if __name__ == "__main__":
    main()
