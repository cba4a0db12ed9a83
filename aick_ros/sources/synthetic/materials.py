# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Materials: what the surfaces of a room look like, at any size."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.sources.synthetic.assembly import Material

Colour = tuple[float, float, float]
"""Red, green, blue, 0 to 255."""


def blank(width: float, height: float, texel: float, colour: Colour) -> np.ndarray:
    """Return a picture of one colour for a surface of some size [m]."""
    shape = max(2, round(height / texel)), max(2, round(width / texel)), 3
    return np.full(shape, colour).astype(np.uint8)


def cloud(rng: np.random.Generator, shape: tuple[int, int], cell: tuple[float, float],
          octaves: int = 1) -> np.ndarray:
    """
    Return smooth noise, HxW float32 of about -1 to 1.

    :param cell: rows and columns from one hill to the next [texels]; halved in each octave.
    """
    total: np.ndarray = np.zeros(shape, np.float32)
    weight = 1.0
    for octave in range(octaves):
        grid = [max(2, int(np.ceil(n / c * 2 ** octave)) + 1) for n, c in zip(shape, cell)]
        hills = rng.uniform(-1, 1, grid).astype(np.float32)
        noise: np.ndarray = cv2.resize(hills, shape[::-1], interpolation=cv2.INTER_CUBIC)
        np.add(total, np.float32(weight) * noise, out=total)
        weight *= 0.6
    return total


def tint(colour: Colour | np.ndarray, tone: np.ndarray) -> np.ndarray:
    """Return a picture of a colour, lighter and darker by a tone (1 leaves it), HxW."""
    image: np.ndarray = np.clip(tone[..., None] * np.asarray(colour, np.float32), 0, 255)
    return image.astype(np.uint8)


def shade(image: np.ndarray, tone: np.ndarray) -> np.ndarray:
    """Return the picture, lighter and darker by a tone (1 leaves it), HxW float32."""
    return cv2.multiply(image, cv2.merge([tone] * 3), dtype=cv2.CV_8U)


def hue(rng: np.random.Generator, saturation: tuple[float, float] = (0.2, 0.6),
        value: tuple[float, float] = (0.35, 0.85)) -> Colour:
    """Return a colour of any hue."""
    hsv = np.array([[[rng.uniform(0, 360), rng.uniform(*saturation), rng.uniform(*value)]]],
                   np.float32)
    red, green, blue = 255 * cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)[0, 0]
    return float(red), float(green), float(blue)


def scaled(colour: Colour, factor: float) -> Colour:
    """Return a colour, lighter or darker by a factor."""
    red, green, blue = colour
    return factor * red, factor * green, factor * blue


def plain(colour: Colour, roughness: float = 0.04) -> Material:
    """Painted or plastic, with a little dirt."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        shape = blank(width, height, 0.004, colour).shape[:2]
        return tint(colour, 1 + roughness * cloud(rng, shape, (20, 20), 3))
    return make


def wood(colour: Colour) -> Material:
    """Boards with the grain along their longer side."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        shape = blank(max(width, height), min(width, height), 0.0025, colour).shape[:2]
        image = tint(colour, _grain(rng, shape, 0.0025))
        return image if width >= height else np.ascontiguousarray(image.transpose(1, 0, 2))
    return make


def planks(colour: Colour) -> Material:
    """Return a wooden floor."""
    texel, breadth = 0.0035, 0.12

    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        shape = blank(width, height, texel, colour).shape[:2]
        tone = _grain(rng, shape, texel)
        row = 0
        while row < shape[0]:
            end = row + round(breadth / texel)
            column = -int(rng.integers(0, 300))
            while column < shape[1]:
                length = int(rng.integers(150, 420))
                plank = tone[row:end, max(column, 0):max(column + length, 0)]
                # each plank is from another place of the tree
                plank[:] = rng.uniform(0.8, 1.15) * np.roll(plank, int(rng.integers(0, 40)), 0)
                plank[:, :1] *= 0.45
                column += length
            tone[row:row + 1] *= 0.5
            row = end
        return tint(colour, tone)
    return make


def plaster(colour: Colour) -> Material:
    """Return a painted wall, rough under the paint."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        shape = blank(width, height, 0.005, colour).shape[:2]
        tone = 1 + 0.03 * cloud(rng, shape, (120, 120), 3) + 0.05 * cloud(rng, shape, (5, 5))
        for _ in range(int(25 * width * height)):
            centre = (int(rng.integers(shape[1])), int(rng.integers(shape[0])))
            axes = (int(rng.integers(1, 6)), int(rng.integers(1, 3)))
            cv2.ellipse(tone, centre, axes, float(rng.uniform(0, 180)), 0, 360,
                        float(rng.uniform(0.7, 1.1)), -1, cv2.LINE_AA)
        return tint(colour, tone)
    return make


def wallpaper(colour: Colour, accents: tuple[Colour, ...]) -> Material:
    """Paper with twigs and flowers strewn over it."""
    texel = 0.0035

    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        image = blank(width, height, texel, colour)
        for _ in range(int(38 * width * height)):
            centre = rng.uniform(0, 1, 2) * (width, height) / texel
            _twig(rng, image, centre, rng.uniform(0.05, 0.13) / texel,
                  accents[int(rng.integers(len(accents)))])
        tone = 1 + 0.04 * cloud(rng, image.shape[:2], (3, 200))
        return shade(image, tone)
    return make


def brick(colour: Colour) -> Material:
    """Return a wall of bricks with mortar between them."""
    texel, length, rise = 0.0035, 0.22, 0.075

    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        image = blank(width, height, texel, (176, 168, 158))
        joint = 0.006
        for row in range(int(height / rise) + 1):
            top = row * rise + joint
            left = -rng.uniform(0, 0.03) - (row % 2) * length / 2
            while left < width:
                right = left + length - 0.01 + rng.uniform(-0.008, 0.008)
                corners = np.array([[left + joint, top], [right, top + rise - 2 * joint]]) / texel
                corners += rng.uniform(-0.8, 0.8, (2, 2))
                own = np.asarray(colour) * rng.uniform(0.65, 1.2) + rng.normal(0, 7, 3)
                (x0, y0), (x1, y1) = corners.round().astype(int).tolist()
                cv2.rectangle(image, (x0, y0), (x1, y1), np.clip(own, 0, 255).tolist(), -1)
                left += length
        return shade(image, 1 + 0.10 * cloud(rng, image.shape[:2], (6, 9), 2))
    return make


def fabric(colour: Colour, stripes: Colour | None = None) -> Material:
    """Woven cloth, with stripes where a second colour is given."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        image = blank(width, height, 0.0025, colour)
        shape = image.shape[:2]
        if stripes is not None:
            wide = int(rng.integers(8, 22))
            band = (np.arange(shape[1]) // wide) % 3 == 0
            image[:, band] = stripes
        weave = 0.10 * cloud(rng, shape, (2.5, 2.5)) + 0.07 * cloud(rng, shape, (3, 30))
        return shade(image, 1 + weave + 0.05 * cloud(rng, shape, (90, 90), 2))
    return make


def curtain(colour: Colour, stripes: Colour) -> Material:
    """Cloth in vertical folds."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        cloth = fabric(colour, stripes)(rng, width, height)
        rows, columns = cloth.shape[:2]
        across = np.arange(columns) * 2 * np.pi / 34 + 2 * cloud(rng, (1, columns), (1, 60))[0]
        folds = 0.82 + 0.24 * np.sin(across)
        return shade(cloth, np.repeat(folds[None].astype(np.float32), rows, axis=0))
    return make


def leaves(colour: Colour = (70, 120, 55)) -> Material:
    """Dense foliage."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        image = blank(width, height, 0.002, scaled(colour, 0.35))
        rows, columns = image.shape[:2]
        for i in range(int(9000 * width * height)):
            centre = (int(rng.integers(columns)), int(rng.integers(rows)))
            axes = (int(rng.integers(5, 12)), int(rng.integers(2, 5)))
            own = np.asarray(colour) * rng.uniform(0.5, 1.5) * (1, rng.uniform(0.9, 1.1), 1)
            cv2.ellipse(image, centre, axes, float(rng.uniform(0, 180)), 0, 360,
                        np.clip(own, 0, 255).tolist(), -1, cv2.LINE_AA)
        return image
    return make


def glaze(colour: Colour, band: Colour) -> Material:
    """Glazed clay with painted bands and dots around it."""
    def make(rng: np.random.Generator, width: float, height: float) -> np.ndarray:
        image = blank(width, height, 0.0015, colour)
        rows, columns = image.shape[:2]
        for row in rng.integers(0, rows, 3):
            cv2.line(image, (0, int(row)), (columns, int(row)), band, int(rng.integers(1, 6)))
        for row in rng.integers(0, rows, 2):
            for column in range(0, columns, 14):
                cv2.circle(image, (column + int(rng.integers(-2, 3)), int(row)), 4, band, -1,
                           cv2.LINE_AA)
        return shade(image, 1 + 0.05 * cloud(rng, (rows, columns), (25, 25), 2))
    return make


def _grain(rng: np.random.Generator, shape: tuple[int, int], texel: float) -> np.ndarray:
    fine = cloud(rng, shape, (0.006 / texel, 0.2 / texel), 2)
    across = np.arange(shape[0], dtype=np.float32)[:, None] * np.float32(texel)
    rings = np.sin(2 * np.pi * across / 0.035 + 5 * cloud(rng, shape, (0.08 / texel, 0.6 / texel)))
    tone: np.ndarray = 1 + 0.10 * fine + 0.07 * rings
    for _ in range(int(3 * shape[0] * shape[1] * texel ** 2)):
        centre = (int(rng.integers(shape[1])), int(rng.integers(shape[0])))
        for axes, dark in (((9, 4), 0.8), ((6, 3), 0.6), ((3, 1), 0.4)):
            cv2.ellipse(tone, centre, axes, 0, 0, 360, dark, -1, cv2.LINE_AA)
    return tone


def _twig(rng: np.random.Generator, image: np.ndarray, foot: np.ndarray, length: float,
          colour: Colour) -> None:
    angle = rng.uniform(0, 2 * np.pi)
    along = np.array([np.cos(angle), np.sin(angle)])
    own = np.clip(np.asarray(colour) * rng.uniform(0.7, 1.2), 0, 255).tolist()
    tip = foot + length * along
    cv2.line(image, foot.astype(int).tolist(), tip.astype(int).tolist(), own, 1, cv2.LINE_AA)
    for share, side in zip(np.linspace(0.2, 0.9, 5), (1, -1, 1, -1, 1)):
        centre = foot + share * length * along + side * 0.16 * length * np.array(
            [-along[1], along[0]])
        cv2.ellipse(image, centre.astype(int).tolist(),
                    (max(2, int(0.17 * length)), max(1, int(0.07 * length))),
                    float(np.degrees(angle) + side * 50), 0, 360, own, -1, cv2.LINE_AA)
    cv2.circle(image, tip.astype(int).tolist(), max(2, int(0.11 * length)), own, -1, cv2.LINE_AA)
    cv2.circle(image, tip.astype(int).tolist(), max(1, int(0.04 * length)),
               (240, 225, 180), -1, cv2.LINE_AA)
