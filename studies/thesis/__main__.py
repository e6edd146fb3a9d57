"""Write the page of counterparts of a folder of runs: ``python studies/thesis figures``."""

import sys
from pathlib import Path

from bayesub.io.errors import InputError

sys.path[0] = str(Path(__file__).parents[1])  # where the packages of studies are


def main(folder: str) -> None:
    """Write ``README.md`` into a folder of runs of the thesis's studies, and say so."""
    from thesis import page

    try:
        written = page.write(Path(folder))
    except InputError as error:
        sys.exit(str(error))
    if written is None:
        sys.exit(f"{folder}: holds no run of a study that the thesis has rows for")
    print(f"beside the thesis: {written}")


if __name__ == "__main__":
    main(*sys.argv[1:])
