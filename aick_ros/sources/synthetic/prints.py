# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Things with something on them: books, posters, papers, screens, rugs, fronts of furniture."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.sources.synthetic.assembly import Material
from aick_ros.sources.synthetic.drawings import (
    INK, chart, diagram, ink_on, landscape, lines, ornament, shapes, title, write)
from aick_ros.sources.synthetic.materials import Colour, blank, cloud, hue, shade, tint, wood

# ground, border, then the colours of the ornaments
_RUGS = (((120, 34, 36), (34, 40, 70), (226, 208, 170), (180, 120, 60), (90, 110, 120)),
         ((44, 62, 92), (110, 40, 40), (224, 212, 182), (168, 138, 84), (130, 150, 160)),
         ((190, 166, 124), (70, 84, 70), (236, 226, 204), (140, 60, 48), (60, 76, 96)))


def spines(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of the backs of a row of books."""
    texel = 0.0015
    image = blank(width, height, texel, (30, 24, 20))
    rows, columns = image.shape[:2]
    left = 0
    while left < columns:
        right = left + int(rng.uniform(0.018, 0.05) / texel)
        right = columns if columns - right < 10 else right
        top = 0 if left == 0 else int(rng.uniform(0, 0.12) * rows)
        colour = hue(rng, (0.1, 0.55), (0.25, 0.8))
        book = image[top:, left:right]
        book[:] = _spine(rng, book.shape[0], book.shape[1], colour)
        left = right
    return image


def cover(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of the front of a book or a magazine."""
    image = blank(width, height, 0.0015, hue(rng, (0.15, 0.55), (0.4, 0.9)))
    rows, columns = image.shape[:2]
    ink = ink_on(image[0, 0])
    margin = columns // 12
    top, bottom = int(0.32 * rows), int(0.8 * rows)
    image[top:bottom, margin:columns - margin] = landscape(
        rng, bottom - top, columns - 2 * margin)
    write(image, title(rng, 2), (margin, margin, columns - margin, top - margin), ink)
    write(image, title(rng, 3), (margin, bottom + margin // 2, columns - margin,
                                 bottom + (rows - bottom) // 2), ink)
    return image


def poster(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of a framed picture: a landscape, shapes or a map."""
    image = blank(width, height, 0.002, (236, 230, 218))
    rows, columns = image.shape[:2]
    edge = max(5, round(min(rows, columns) / 22))
    inner = image[2 * edge:rows - 3 * edge, 2 * edge:columns - 2 * edge]
    drawing = (landscape, shapes, chart)[int(rng.integers(3))]
    inner[:] = drawing(rng, *inner.shape[:2])
    write(image, title(rng, 3), (2 * edge, rows - 3 * edge + 2, columns - 2 * edge,
                                 rows - edge - 3), INK)
    cv2.rectangle(image, (0, 0), (columns - 1, rows - 1), hue(rng, (0.1, 0.5), (0.1, 0.4)), edge)
    return image


def page(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of a sheet of paper with a headline, lines and perhaps a diagram."""
    image = blank(width, height, 0.0015, (240, 238, 230))
    rows, columns = image.shape[:2]
    margin = columns // 10
    write(image, title(rng, 2), (margin, margin, columns - margin, margin + rows // 11), INK)
    top = margin + rows // 7
    if rng.random() < 0.5:
        bottom = top + rows // 3
        image[top:bottom, margin:columns - margin] = diagram(
            rng, bottom - top, columns - 2 * margin)
        top = bottom + margin // 2
    lines(rng, image[top:rows - margin, margin:columns - margin], 7, [INK])
    return image


def screen(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of a monitor with a few windows open."""
    image = blank(width, height, 0.0015, (0, 0, 0))
    rows, columns = image.shape[:2]
    image[:] = shade(landscape(rng, rows, columns), np.full((rows, columns), 0.6, np.float32))
    code = [(240, 200, 110), (130, 200, 250), (150, 220, 150), (220, 220, 220)]
    for x, y, w, h, dark in ((0.04, 0.08, 0.5, 0.8, True), (0.48, 0.2, 0.48, 0.55, False)):
        x0, y0 = int(x * columns), int(y * rows)
        window = image[y0:y0 + int(h * rows), x0:x0 + int(w * columns)]
        window[:] = (34, 36, 44) if dark else (228, 228, 224)
        window[:10] = (80, 110, 160)
        lines(rng, window[18:-6, 8:-6], 8, code if dark else [INK, (40, 80, 160)])
    cv2.rectangle(image, (0, 0), (columns - 1, rows - 1), (18, 18, 18), 12)
    return image


def keyboard(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of a keyboard from above."""
    image = blank(width, height, 0.0015, (40, 40, 44))
    rows, columns = image.shape[:2]
    pitch = rows / 6
    for row in range(6):
        left = 4.0
        while left < columns - pitch:
            wide = pitch * (1 if row < 5 or rng.random() < 0.6 else 4)
            corners = (int(left), int(row * pitch) + 2,
                       int(min(left + wide, columns - 3)) - 2, int((row + 1) * pitch) - 1)
            cv2.rectangle(image, corners[:2], corners[2:], (205, 205, 200), -1)
            write(image, chr(int(rng.integers(65, 91))), (
                corners[0] + 3, corners[1] + 3, corners[0] + int(pitch) - 5, corners[3] - 4),
                INK)
            left += wide
    return image


def rug(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of a carpet with borders and ornaments, the same on all four quarters."""
    ground, border, *accents = _RUGS[int(rng.integers(len(_RUGS)))]
    quarter = blank(width / 2, height / 2, 0.003, ground)
    rows, columns = quarter.shape[:2]
    accents = [border, *accents]
    light = accents[1]
    for _ in range(int(190 * width * height / 4)):
        x, y = int(rng.integers(columns)), int(rng.integers(rows))
        ornament(rng, quarter, (x, y), accents)
    for depth, colour in ((46, border), (40, light), (36, border), (10, light), (7, ground)):
        quarter[:depth] = colour
        quarter[:, :depth] = colour
    for along in range(22, max(rows, columns), 24):
        ornament(rng, quarter, (along, 23), accents[1:])
        ornament(rng, quarter, (23, along), accents[1:])
    half = np.hstack([quarter, quarter[:, ::-1]])
    whole = np.vstack([half, half[::-1]])
    return shade(whole, 1 + 0.13 * cloud(rng, whole.shape[:2], (2, 2))
                 + 0.08 * cloud(rng, whole.shape[:2], (60, 60), 2))


def view(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of a window with what is outside."""
    image = blank(width, height, 0.003, (0, 0, 0))
    rows, columns = image.shape[:2]
    outside = landscape(rng, rows, columns, sky=(150, 190, 230), land=(110, 140, 90))
    image[:] = cv2.addWeighted(outside, 0.75, image, 0, 62)
    frame = round(0.05 / 0.003)
    for x in (frame // 2, columns // 2, columns - frame // 2):
        cv2.line(image, (x, 0), (x, rows), (228, 226, 220), frame)
    for y in (frame // 2, rows // 3, rows - frame // 2):
        cv2.line(image, (0, y), (columns, y), (228, 226, 220), frame)
    return image


def globe(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of land and sea, with a grid."""
    image = chart(rng, *blank(width, height, 0.0015, (0, 0, 0)).shape[:2])
    rows, columns = image.shape[:2]
    for share in np.arange(1, 12) / 12:
        cv2.line(image, (int(share * columns), 0), (int(share * columns), rows), (90, 90, 80), 1)
        cv2.line(image, (0, int(share * rows)), (columns, int(share * rows)), (90, 90, 80), 1)
    return image


def clock(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of the face of a clock."""
    image = blank(width, height, 0.0015, (238, 236, 228))
    centre, radius = (image.shape[1] // 2, image.shape[0] // 2), image.shape[0] // 2
    cv2.circle(image, centre, radius, (50, 40, 36), max(3, radius // 9), cv2.LINE_AA)
    for hour in range(12):
        x, y = (centre + 0.74 * radius * np.array(
            [np.sin(hour * np.pi / 6), -np.cos(hour * np.pi / 6)])).astype(int)
        size = radius // 7
        write(image, str(hour or 12), (x - size, y - size, x + size, y + size), INK)
    for length, angle in ((0.45, rng.uniform(0, 6)), (0.65, rng.uniform(0, 6))):
        tip = (centre + length * radius * np.array([np.sin(angle), np.cos(angle)])).astype(int)
        cv2.line(image, centre, tip.tolist(), INK, max(2, radius // 20), cv2.LINE_AA)
    return image


def carton(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
    """Return an image of a side of a cardboard box with tape, a stamp and a label."""
    image = blank(width, height, 0.002, (176, 136, 92))
    rows, columns = image.shape[:2]
    image = shade(image, 1 + 0.08 * cloud(rng, (rows, columns), (3, 60))
                  + 0.05 * cloud(rng, (rows, columns), (40, 40), 2))
    image[:, columns // 2 - 10:columns // 2 + 10] = (196, 168, 120)
    label = page(rng, 0.45 * width, 0.45 * height)
    label = cv2.resize(label, (max(2, int(0.4 * columns)), max(2, int(0.4 * rows))),
                       interpolation=cv2.INTER_AREA)
    top, left = int(rng.uniform(0.1, 0.5) * rows), int(rng.uniform(0.04, 0.5) * columns)
    image[top:top + len(label), left:left + label.shape[1]] = label
    write(image, title(rng, 1), (columns // 12, int(0.84 * rows), columns // 2,
                                 int(0.96 * rows)), (60, 40, 30))
    return image


def drawers(colour: Colour, columns: int, rows: int) -> Material:
    """Return the front of a chest of drawers."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        image = wood(colour)(rng, width, height)
        tall, wide = image.shape[0] / rows, image.shape[1] / columns
        for row in range(rows):
            for column in range(columns):
                x0, y0 = int(column * wide) + 5, int(row * tall) + 5
                x1, y1 = int((column + 1) * wide) - 5, int((row + 1) * tall) - 5
                image[y0:y1, x0:x1] = shade(image[y0:y1, x0:x1].copy(), np.full(
                    (y1 - y0, x1 - x0), rng.uniform(0.95, 1.15), np.float32))
                cv2.rectangle(image, (x0, y0), (x1, y1), [0.35 * c for c in colour], 2)
                knob = (x0 + x1) // 2, (y0 + y1) // 2
                cv2.circle(image, knob, 8, (60, 52, 40), -1, cv2.LINE_AA)
                cv2.circle(image, (knob[0] - 2, knob[1] - 2), 4, (214, 190, 130), -1, cv2.LINE_AA)
        return image
    return make


def door(colour: Colour) -> Material:
    """Return a door with four panels and a handle."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        image = wood(colour)(rng, width, height)
        rows, columns = image.shape[:2]
        dark, light = [0.55 * c for c in colour], [min(255, 1.25 * c) for c in colour]
        for y0, y1 in ((0.06, 0.42), (0.52, 0.94)):
            for x0, x1 in ((0.12, 0.46), (0.54, 0.88)):
                corner = int(x0 * columns), int(y0 * rows)
                opposite = int(x1 * columns), int(y1 * rows)
                cv2.rectangle(image, corner, opposite, dark, 4)
                cv2.rectangle(image, (corner[0] + 8, corner[1] + 8),
                              (opposite[0] - 8, opposite[1] - 8), light, 2)
        cv2.rectangle(image, (0, 0), (columns - 1, rows - 1), dark, 6)
        cv2.line(image, (int(0.9 * columns), rows // 2), (int(0.99 * columns) - 4, rows // 2),
                 (190, 180, 150), 8)
        return image
    return make


def _spine(rng: np.random.Generator, rows: int, columns: int, colour: Colour) -> np.ndarray:
    across = np.linspace(-1, 1, columns, dtype=np.float32)
    image = tint(colour, np.repeat((1.05 - 0.35 * across ** 2)[None], rows, axis=0))
    ink = ink_on(np.asarray(colour))
    for share in rng.uniform(0.04, 0.96, int(rng.integers(1, 4))):
        row = int(share * rows)
        image[row:row + int(rng.integers(2, 7))] = ink if rng.random() < 0.5 else hue(rng)
    # titles run along the book
    lying = np.ascontiguousarray(np.rot90(image))
    side = columns // 5
    start = int(rng.uniform(0.08, 0.2) * rows)
    write(lying, title(rng, 2), (start, side, int(0.72 * rows), columns - side), ink)
    write(lying, title(rng, 1), (int(0.78 * rows), side + 2, int(0.95 * rows),
                                 columns - side - 2), ink)
    return np.rot90(lying, -1)
