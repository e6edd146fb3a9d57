"""Templates (Jinja): each stands beside the module that fills it."""

from importlib import resources


def fill(package: str, name: str, /, **values) -> str:
    """The text of a template with its values.

    Parameters
    ----------
    package : str
        The package that holds the template, such as ``bayesub.study``.
    name : str
        File name; in ``.html`` the values are escaped.
    **values
        What the names in the template stand for. A name without a value is an error.
    """
    import jinja2  # only here, so that commands without a template start at once

    environment = jinja2.Environment(
        autoescape=name.endswith(".html"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=not name.endswith(".html"),
        undefined=jinja2.StrictUndefined,
    )
    text = (resources.files(package) / name).read_text(encoding="utf-8")
    return environment.from_string(text).render(values)
