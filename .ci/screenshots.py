#!/usr/bin/env python3
"""Compares screenshots of the first screens with the committed small ones, or makes these anew.

screenshots.py compare|accept TAKEN_FOLDER COMMITTED_FOLDER

A screenshot is reduced to blocks of 8 x 8 pixels and may differ from the committed one by MEAN on average (of 255), and by FAR in
no more than SHARE of its values. All text is set in one font (`.ci/browser`): in another one, lines break elsewhere, and the pages of
Liberation Sans differ from those of DejaVu Sans by 15 to 23 on average, as much as two different pages do. With the font the same,
hinting makes no difference at this size. The limits lie at about half of what the smallest faults make that were tried on the pages
of `monitor` and `diagnose`, 1280 and 400 px wide: MEAN 1.1 and SHARE 0.008 without the three numbers, 1.4 and 0.018 without the lines of
the picture, 2.0 and 0.026 without the picture, 6.5 and 0.086 with all below the numbers moved by 48 px, 9 and 0.11 with a larger title. A
missing badge (0.1) is found by `.ci/browser.js`. Python's own library reads and writes the PNGs.
"""
import pathlib
import struct
import sys
import zlib

BLOCK = 8
MEAN, FAR, SHARE = 0.6, 30, 0.005


def read(path):
    """(width, height, rows of RGB values) of an 8 bit PNG that is not interlaced."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path} is no PNG"
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            assert depth == 8 and colour in (2, 6) and not interlaced, f"{path} is not 8 bit RGB"
        if kind == b"IDAT":
            packed += body
        at += length + 12
    step = 3 if colour == 2 else 4
    raw, rows, before = zlib.decompress(packed), [], bytearray(width * step)
    for y in range(height):
        start = y * (width * step + 1)
        row = unfiltered(raw[start], bytearray(raw[start + 1 : start + 1 + width * step]), before, step)
        rows.append(row if step == 3 else bytearray(v for i, v in enumerate(row) if i % 4 != 3))
        before = row
    return width, height, rows


def unfiltered(kind, row, above, step):
    for i in range(len(row)):
        a = row[i - step] if i >= step else 0
        b = above[i]
        c = above[i - step] if i >= step else 0
        if kind == 1:
            row[i] = (row[i] + a) & 255
        elif kind == 2:
            row[i] = (row[i] + b) & 255
        elif kind == 3:
            row[i] = (row[i] + (a + b) // 2) & 255
        elif kind == 4:
            near = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            row[i] = (row[i] + near) & 255
    return row


def reduced(width, height, rows):
    """The means of all whole blocks."""
    out = []
    for top in range(0, height - BLOCK + 1, BLOCK):
        line = bytearray()
        for left in range(0, width - BLOCK + 1, BLOCK):
            for channel in range(3):
                total = sum(sum(row[3 * left + channel : 3 * (left + BLOCK) : 3]) for row in rows[top : top + BLOCK])
                line.append(total // (BLOCK * BLOCK))
        out.append(line)
    return width // BLOCK, height // BLOCK, out


def write(path, width, height, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 9)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b""))


def differs(taken, committed):
    """Why they differ too much; None where they don't."""
    if taken[:2] != committed[:2]:
        return f"{taken[0]} x {taken[1]} blocks, committed are {committed[0]} x {committed[1]}"
    away = [abs(a - b) for t, c in zip(taken[2], committed[2]) for a, b in zip(t, c)]
    mean, far = sum(away) / len(away), sum(v > FAR for v in away) / len(away)
    print(f"  mean difference {mean:.2f} of 255 (at most {MEAN}), far in {100 * far:.2f} % (at most {100 * SHARE})")
    if mean > MEAN or far > SHARE:
        return f"it differs by {mean:.1f} of 255 on average, by more than {FAR} in {100 * far:.1f} % of its blocks"
    return None


def main(action, taken_folder, committed_folder):
    failed = False
    for path in sorted(pathlib.Path(taken_folder).glob("*.png")):
        small = reduced(*read(path))
        committed = pathlib.Path(committed_folder) / path.name
        if action == "accept":
            write(committed, *small)
            continue
        print(f"screenshot {path.name}")
        if not any(pathlib.Path(committed_folder).glob("*.png")):
            print("  none is committed yet: .ci/browser --accept")
            continue
        why = differs(small, read(committed)) if committed.exists() else "there is none to compare with"
        if why:
            failed = True
            print(f"screenshot {path.name}: {why}; if it is better: .ci/browser --accept")
    sys.exit(failed)


main(*sys.argv[1:])
