"""The symbols of coefficients in text."""

import re
import unicodedata

from markupsafe import Markup

_GREEK = {"delta": "δ", "nu": "ν", "eta": "η"}


def html(label: str) -> Markup:
    r"""A label such as ``$N'_{v|\nu|}$`` in HTML, with its subscript."""
    text = re.sub(r"\\dot\{?(\w)\}?", "\\1\u0307", label.strip("$"))
    text = re.sub(r"\\([a-z]+)", lambda match: _GREEK.get(match[1], match[1]), text).replace("'", "\u2032")
    letter, _, subscript = unicodedata.normalize("NFC", text).partition("_")
    return Markup("<i>{}</i><sub>{}</sub>").format(letter, re.sub(r"[{}_ ]", "", subscript))
