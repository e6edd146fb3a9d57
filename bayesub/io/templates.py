"""Templates (Jinja): each stands beside the module that fills it, all are of one environment."""

import json
from functools import cache, partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import jinja2


@cache
def environment() -> "jinja2.Environment":
    """The environment of all templates: files of the package by path, a name without a value is an error.

    What stands in HTML is escaped; a template may include others, by their paths in the package.
    """
    import jinja2  # only here, so that commands without a template start at once

    made = jinja2.Environment(
        loader=jinja2.PackageLoader("bayesub", "."),
        autoescape=lambda name: name is not None and name.endswith(".html"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    made.filters["toml"] = partial(json.dumps, ensure_ascii=False)  # of a text
    made.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    return made


def fill(package: str, name: str, /, **values) -> str:
    """The text of a template, a file of a package such as ``bayesub.study.new``, with values for all its names."""
    folder = "/".join(package.split(".")[1:])
    return environment().get_template(f"{folder}/{name}").render(values)
