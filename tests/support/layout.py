"""Whether what is written in a figure can be read: texts that leave the canvas, and texts on each other."""

from itertools import combinations

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

SLACK = 0.18  # of the height of a text, that its box is larger than its letters
EDGE = 2.0  # pixels


def unreadable(figure: Figure, monkeypatch) -> list[str]:
    """Texts of a figure that are outside of its canvas or overlap another one, as sentences."""
    drawn: list[Text] = []
    draw = Text.draw

    def record(self, renderer, *args, **kwargs):
        if self.get_visible() and self.get_text().strip():
            drawn.append(self)
        return draw(self, renderer, *args, **kwargs)

    canvas = FigureCanvasAgg(figure)
    with monkeypatch.context() as patch:
        patch.setattr(Text, "draw", record)
        canvas.draw()
    texts = list(dict.fromkeys(drawn))
    width, height = canvas.get_width_height()
    boxes = [_corners(text, canvas.get_renderer()) for text in texts]
    found = []
    for text, (outer, _) in zip(texts, boxes, strict=True):
        low, high = outer.min(axis=0), outer.max(axis=0)
        if np.any(low < -EDGE) or np.any(high > np.array([width, height]) + EDGE):
            found.append(f"{text.get_text()!r} leaves the canvas")
    for (one, (_, a)), (other, (_, b)) in combinations(zip(texts, boxes, strict=True), 2):
        if _overlap(a, b):
            found.append(f"{one.get_text()!r} overlaps {other.get_text()!r}")
    return found


def _corners(text: Text, renderer) -> tuple[np.ndarray, np.ndarray]:
    """Corners (4, 2) of the box of a text, in pixels, turned as the text is, and of what its letters fill of it."""
    extent = text.get_window_extent(renderer)
    angle = np.radians(text.get_rotation())
    turned = text.get_rotation()
    text.set_rotation(0.0)
    level = text.get_window_extent(renderer)
    text.set_rotation(turned)
    rows = text.get_text().count("\n") + 1
    slack = SLACK * level.height / rows
    along = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    middle = np.array([0.5 * (extent.x0 + extent.x1), 0.5 * (extent.y0 + extent.y1)])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return tuple(
        middle + corners * np.maximum(half, 0.1) @ along
        for half in (
            0.5 * np.array([level.width, level.height]),
            0.5 * np.array([level.width - slack, level.height - 2 * slack]),
        )
    )


def _overlap(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two rectangles (4, 2) have a common point: no side of either separates them."""
    for box in (a, b):
        for axis in (box[1] - box[0], box[2] - box[1]):
            if (a @ axis).max() <= (b @ axis).min() or (b @ axis).max() <= (a @ axis).min():
                return False
    return True
