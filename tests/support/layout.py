"""Whether what is written in a figure can be read: texts that leave the canvas, and texts on each other."""

from itertools import combinations

import numpy as np
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.text import Text

SLACK = 0.18  # of the height of a line, that its box is larger than its letters
EDGE = 2.0  # pixels
_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


class WrittenTexts:
    """All texts that are drawn to PNGs while a test runs, with where they are then.

    Attributes
    ----------
    texts : of each the figure, the words, corners (4, 2) of its box and of what letters fill of it, and the canvas
    """

    def __init__(self, monkeypatch) -> None:
        self.texts: list[tuple] = []
        draw = Text.draw

        def record(text, renderer, *args, **kwargs):
            if isinstance(renderer, RendererAgg) and text.get_visible() and text.get_text().strip():
                canvas = renderer.get_canvas_width_height()
                self.texts.append((id(text.get_figure(root=True)), text.get_text(), *_corners(text, renderer), canvas))
            return draw(text, renderer, *args, **kwargs)

        monkeypatch.setattr(Text, "draw", record)

    def unreadable(self) -> list[str]:
        """What leaves its canvas or overlaps another text, as sentences."""
        found = []
        for _, words, box, _, canvas in self.texts:
            if np.any(box.min(axis=0) < -EDGE) or np.any(box.max(axis=0) > np.array(canvas) + EDGE):
                found.append(f"{words!r} leaves the canvas")
        for one, other in combinations(self.texts, 2):
            if one[0] == other[0] and _overlap(one[3], other[3]):
                found.append(f"{one[1]!r} overlaps {other[1]!r}")
        return found


def _corners(text: Text, renderer) -> tuple[np.ndarray, np.ndarray]:
    """Corners (4, 2) in pixels of the box of a text, turned as the text is, and of what its letters fill of it."""
    turned, extent = text.get_rotation(), text.get_window_extent(renderer)
    text.set_rotation(0.0)
    level = text.get_window_extent(renderer)
    text.set_rotation(turned)
    angle, slack = np.radians(turned), SLACK * level.height / (text.get_text().count("\n") + 1)
    along = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    middle, size = 0.5 * (extent.min + extent.max), np.array([level.width, level.height])
    inner = np.maximum(size - [slack, 2.0 * slack], 0.2)
    return middle + 0.5 * _CORNERS * size @ along, middle + 0.5 * _CORNERS * inner @ along


def _overlap(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two rectangles (4, 2) have a common point: no side of either separates them."""
    for box in (a, b):
        for axis in (box[1] - box[0], box[2] - box[1]):
            if (a @ axis).max() <= (b @ axis).min() or (b @ axis).max() <= (a @ axis).min():
                return False
    return True
