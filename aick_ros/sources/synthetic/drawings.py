# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pictures and writing, as they are on posters, covers, papers and screens."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from aick_ros.sources.synthetic.materials import Colour, cloud, hue, tint

INK = (38, 36, 40)

_WORDS = ('NORTH', 'HARBOUR', 'ATLAS', 'WINTER', 'RIVERS', 'OF', 'GLASS', 'THE', 'SILENT', 'MAPS',
          'GARDEN', 'LIGHT', 'STONE', 'AND', 'SEA', 'HOUSE', 'A', 'MOTION', 'FIELD', 'NOTES')


def landscape(rng: np.random.Generator, rows: int, columns: int, sky: Colour | None = None,
              land: Colour | None = None) -> np.ndarray:
    """Draw hills behind hills, a sky with clouds, a sun and trees."""
    above = np.asarray(sky or hue(rng, (0.3, 0.6), (0.6, 0.9)))
    share = np.linspace(0, 1, rows, dtype=np.float32)[:, None, None]
    air = np.repeat(above + share * (0.7 * (255 - above)), columns, axis=1)
    clouds = np.maximum(cloud(rng, (rows, columns), (rows / 4, columns / 3), 4), 0)[..., None]
    image: np.ndarray = np.clip(air + 70 * clouds, 0, 255).astype(np.uint8)
    centre = int(rng.uniform(0.15, 0.85) * columns), int(rng.uniform(0.12, 0.4) * rows)
    cv2.circle(image, centre, max(3, rows // 14), (255, 244, 210), -1, cv2.LINE_AA)
    colour = np.asarray(land or hue(rng, (0.2, 0.6), (0.5, 0.7)))
    for layer, height in enumerate((0.45, 0.58, 0.72, 0.86)):
        ridge = height + 0.10 * cloud(rng, (1, columns), (1, columns / 3), 5)[0]
        below = np.arange(rows)[:, None] > ridge * rows
        tone = (1 - 0.2 * layer) * (1 + 0.2 * cloud(rng, (rows, columns), (6, 9), 2))
        image[below] = tint(colour, tone)[below]
        for column in rng.integers(0, columns, columns // 30 if layer > 1 else 0):
            foot, size = int(ridge[column] * rows), max(4, int(rng.uniform(0.03, 0.09) * rows))
            tree = [[column, foot - 2 * size], [column - size // 2, foot + 2],
                    [column + size // 2, foot + 2]]
            cv2.fillPoly(image, [np.array(tree, np.int32)], (0.4 * colour).tolist(), cv2.LINE_AA)
    return image


def shapes(rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    """Draw an abstract painting."""
    image = np.full((rows, columns, 3), hue(rng, (0.05, 0.25), (0.8, 0.95))).astype(np.uint8)
    for _ in range(26):
        centre = int(rng.integers(columns)), int(rng.integers(rows))
        size = rng.uniform(0.03, 0.2) * min(rows, columns)
        colour = hue(rng, (0.4, 0.9), (0.2, 0.9))
        if rng.random() < 0.5:
            cv2.circle(image, centre, int(size), colour, -1, cv2.LINE_AA)
            cv2.circle(image, centre, int(0.55 * size), hue(rng), int(1 + size / 8), cv2.LINE_AA)
        else:
            box = cv2.boxPoints((centre, (3 * size, 0.8 * size), float(rng.uniform(0, 180))))
            cv2.fillPoly(image, [box.astype(np.int32)], colour, cv2.LINE_AA)
    return image


def chart(rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    """Draw a map: land, sea, heights and towns."""
    height = cloud(rng, (rows, columns), (rows / 3, columns / 4), 5) + 0.05
    image = np.empty((rows, columns, 3), np.uint8)
    image[:] = (122, 166, 196)
    for level, colour in ((0, (196, 206, 150)), (0.2, (214, 200, 140)), (0.45, (180, 146, 100)),
                          (0.75, (236, 232, 226))):
        image[height > level] = colour
        shore = (height > level) & (cv2.blur(height, (3, 3)) < level + 0.012)
        image[shore] = (84, 92, 84)
    for column, row in zip(rng.integers(0, columns, 14), rng.integers(0, rows, 14)):
        cv2.circle(image, (int(column), int(row)), 3, (150, 30, 30), -1, cv2.LINE_AA)
        write(image, title(rng, 1), (int(column) + 5, int(row) - 5, int(column) + 44,
                                     int(row) + 5), INK)
    return image


def diagram(rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    """Draw a diagram with bars."""
    image = np.full((rows, columns, 3), 250, np.uint8)
    cv2.rectangle(image, (0, 0), (columns - 1, rows - 1), INK, 1)
    bars = np.linspace(6, columns - 12, 8).astype(int)
    for x, share in zip(bars, rng.uniform(0.1, 0.9, len(bars))):
        cv2.rectangle(image, (int(x), int(rows * share)), (int(x) + columns // 14, rows - 3),
                      hue(rng), -1)
    return image


def lines(rng: np.random.Generator, image: np.ndarray, pitch: int, inks: Sequence[Colour]) -> None:
    """Write lines of words too small to be read."""
    for top in range(2, len(image) - 4, pitch):
        ink, column = inks[int(rng.integers(len(inks)))], int(rng.integers(0, 3)) * 8
        end = rng.uniform(0.5, 1) * image.shape[1]
        while column < end - 4:
            letters = int(rng.integers(2, 8))
            for x in range(column, min(column + 3 * letters, int(end)), 3):
                tall = int(rng.integers(2, 5))
                image[top + 4 - tall:top + 4, x:x + 2] = ink
            column += 3 * letters + 4


def ornament(rng: np.random.Generator, image: np.ndarray, centre: tuple[int, int],
             colours: Sequence[Colour]) -> None:
    """Draw one ornament of two colours."""
    size = int(rng.integers(5, 15))
    outer, inner = (colours[int(i)] for i in rng.permutation(len(colours))[:2])
    x, y = centre
    rhomb = np.array([[x - size, y], [x, y - size], [x + size, y], [x, y + size]], np.int32)
    if rng.random() < 0.5:
        cv2.fillPoly(image, [rhomb], outer, cv2.LINE_AA)
    else:
        cv2.circle(image, centre, size, outer, -1, cv2.LINE_AA)
    cv2.circle(image, centre, max(2, size // 2), inner, -1, cv2.LINE_AA)


def title(rng: np.random.Generator, words: int) -> str:
    """Make up a title."""
    return ' '.join(_WORDS[int(i)] for i in rng.integers(0, len(_WORDS), words))


def ink_on(colour: np.ndarray) -> Colour:
    """Return the ink that can be read on a colour."""
    return INK if np.mean(colour) > 120 else (238, 226, 190)


def write(image: np.ndarray, text: str, box: tuple[int, int, int, int], ink: Colour) -> None:
    """Write text as large as it fits into a box: left, top, right, bottom."""
    left, top, right, bottom = box
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_DUPLEX, 1.0, 1)
    scale = min((right - left) / width, (bottom - top) / height)
    if scale > 0.12:
        foot = int(top + (bottom - top + scale * height) / 2)
        cv2.putText(image, text, (int(left), foot), cv2.FONT_HERSHEY_DUPLEX, scale,
                    tuple(float(c) for c in ink), max(1, round(1.4 * scale)), cv2.LINE_AA)
