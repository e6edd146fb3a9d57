"""What captive model tests say of coefficients: the posterior given forces at prescribed motions.

Forces of a model that is towed, turned by a rotating arm or moved by a planar motion mechanism are linear in the
coefficients. With normal errors and a normal prior their posterior is normal, and exact, without a simulation.
"""

import warnings
from pathlib import Path

import numpy as np

from bayesub.design.knowledge import Knowledge, of_moments
from bayesub.io import toml_files
from bayesub.io.errors import InputError, check_known
from bayesub.logs.log_files import ACCELERATIONS, VELOCITIES, positions, si_factor
from bayesub.model.equations import AXES
from bayesub.model.vehicles import Vehicle
from bayesub.problem.priors import from_vehicle, relative_normal

MOTION = tuple(f"{name}_prime" for name in (*VELOCITIES, *ACCELERATIONS))
PROPELLER = "n_over_n0"  # its revolutions over those of self-propulsion at the trial speed
LABEL = "run"  # a column of names, which are not read
SD = 0.25  # of the prior where the file has none, of the value
_ROUND_OFF = 1e-10  # of the largest singular value, of what is not unique; of the largest force, of errors
_SMALLEST, _LARGEST = 1e-12, 1e6  # sd of a force, and number


def known_by(boat: Vehicle, path: Path) -> tuple[Knowledge, np.ndarray, list[tuple[str, ...]]]:
    """The posterior of n coefficients given a table of captive tests, their prior sds (n,), and words for each axis.

    The prior has the sds of the vehicle file, else :data:`SD` of the value: what is zero without an sd is held. Errors
    of forces have the sds of the column ``<axis>_prime_sd``; else of what least squares leave, widened to Student's t.

    InputError for a table that cannot be read, or that has too few forces to estimate their errors.
    """
    table, equations = _read(path, boat), boat.equations
    measured = [axis for axis in AXES if f"{axis}_prime" in table]
    has_sd = np.isfinite(boat.sd)
    can = (has_sd | (boat.xi != 0.0)) & (has_sd | [term.axis in measured for term in equations.terms])
    places, held = np.flatnonzero(can), np.where(can, 0.0, boat.xi)
    prior = from_vehicle(boat, relative_normal(SD)).on(places, boat.xi, equations)
    root = prior.chain(np.eye(len(places)), np.zeros(len(places)))
    velocities, accelerations = np.split(np.stack([table[name] for name in MOTION], axis=1), 2, axis=1)
    controls = [table[control.column] * si_factor(control.column) for control in equations.controls]
    motion = velocities, accelerations, np.stack([*controls, table[PROPELLER]], axis=1)
    derivatives, rests, words = [], [], []
    for axis, block in forces(boat, *motion).items():
        header, columns = f"{axis}_prime", equations.columns(equations.names_of_axis(axis))
        if axis not in measured:
            continue
        rows, free = np.isfinite(table[header]), can[columns]
        if not free.any() or not rows.any():
            lack = f"the vehicle has no coefficient of axis {axis} with a value or an sd" if rows.any() else "is empty"
            raise InputError(f"{path}: column '{header}': {lack}; delete the column", "data", header)
        matrix, rest = block[rows][:, free], table[header][rows] - block[rows] @ held[columns]
        said, errors = _fit(axis, path, matrix, rest, table[f"{header}_sd"][rows])
        of_all = np.zeros((len(rest), len(places)))
        of_all[:, np.isin(places, columns)] = matrix / errors[:, None]
        derivatives.append(of_all)
        rests.append(rest / errors)
        words.append(said)
    whole = np.concatenate(derivatives)
    q, r = np.linalg.qr(np.vstack([whole @ root, np.eye(len(places))]))
    spread = root @ np.linalg.inv(r)
    mean = prior.mean + spread @ (q[: len(whole)].T @ (np.concatenate(rests) - whole @ prior.mean))
    known = of_moments([equations.names[k] for k in places], mean, spread @ spread.T)
    return known, np.linalg.norm(root, axis=1), words


def _fit(axis, path, matrix, rest, errors):
    """What forces (n,) say by their derivatives (n, n_free), in words, and their sds (n,), estimated if not known."""
    sizes = np.linalg.norm(matrix, axis=0)
    s = np.linalg.svd(matrix / np.where(sizes > 0.0, sizes, 1.0), compute_uv=False)
    kept = s[s > _ROUND_OFF * s[0]]
    if is_estimated := bool(np.isnan(errors).any()):
        spare = len(rest) - len(kept)
        left = rest - matrix @ np.linalg.lstsq(matrix, rest)[0]
        if spare < 3 or not np.abs(left).max() > _ROUND_OFF * np.abs(rest).max():
            few = f"{len(rest)} forces of axis {axis} are too few to estimate their errors, or have none"
            raise InputError(f"{path}: {few}; give these as column '{axis}_prime_sd'", "missing", f"{axis}_prime_sd")
        errors = np.full(len(rest), np.sqrt(np.sum(left**2) / (spare - 2)))
    condition = f"condition {kept[0] / kept[-1]:.3g}" if len(kept) else ""
    size = f"errors of {np.median(errors):.2g}{', estimated' * is_estimated}"
    return (axis, f"{len(rest)} forces", f"determine {len(kept)} of {len(sizes)}", condition, size), errors


def forces(
    boat: Vehicle, velocities: np.ndarray, accelerations: np.ndarray, controls: np.ndarray
) -> dict[str, np.ndarray]:
    """Axis -> (n, n_axis) dimensionless forces for coefficients of one, in the order of the axis.

    Velocities u' v' w' p' q' r' and accelerations, (n, 6) each, are dimensionless by length and trial speed; controls
    (n, n_controls + 1) are those of the equations, SI units, and after them n/n0.
    """
    length, speed, equations = boat.length_m, boat.speed_mps, boat.equations
    scales = np.array([speed] * 3 + [speed / length] * 3)
    states = np.zeros((len(velocities), 12))
    states[:, positions(*VELOCITIES)] = velocities * scales
    with_propeller = np.column_stack([controls[:, :-1], controls[:, -1] * speed])
    found = {}
    moved = states, accelerations * scales * speed / length, with_propeller, boat.constants
    for axis, block in equations.regressors(*moved).items():
        unit = 0.5 * boat.water_density_kgm3 * speed**2 * length ** (2 if axis in "XYZ" else 3)
        found[axis] = block * boat.dimensional_factors[equations.columns(equations.names_of_axis(axis))] / unit
    return found


def _read(path: Path, boat: Vehicle) -> dict[str, np.ndarray]:
    """Column -> (n,) cells of a table of captive runs; motions and controls that it leaves out are zero."""
    import pandas as pd

    loads = [f"{axis}_prime" for axis in AXES if boat.equations.names_of_axis(axis)]
    sds = [f"{name}_sd" for name in loads]
    defaults = dict.fromkeys((*MOTION, *(control.column for control in boat.equations.controls)), 0.0)
    defaults |= {PROPELLER: 1.0} | dict.fromkeys(sds, np.nan)
    options = {"skip_blank_lines": False, "skipinitialspace": True, "encoding": "utf-8-sig", "index_col": False}
    try:
        with toml_files.reading(path), warnings.catch_warnings(action="error", category=pd.errors.ParserWarning):
            cells = pd.read_csv(path, dtype=str, **options).dropna(how="all").drop(columns=LABEL, errors="ignore")
    except (pd.errors.ParserError, pd.errors.EmptyDataError, pd.errors.ParserWarning):
        text = f"{path}: is no table of a header and rows with as many cells, between commas; write decimal points"
        raise InputError(text, "format") from None
    for name in cells:
        check_known(name, (*defaults, *loads, LABEL), f"{path}: unknown column '{name}'")
    if not (cells.columns.isin(loads).any() and "u_prime" in cells):
        name = "u_prime" if "u_prime" not in cells else loads[0]
        raise InputError(f"{path}: column '{name}' is missing", "missing", name)
    numbers = cells.apply(pd.to_numeric, errors="coerce").astype(float)
    for name, column in numbers.items():
        least, most = (_SMALLEST if name in sds else -np.inf), min(toml_files.largest(name), _LARGEST)
        is_right = (column >= least) & (column.abs() <= most) | (cells[name].isna() & (name in loads))
        for line in column.index[~is_right][:1]:
            what = f"from {_SMALLEST:g} to" if name in sds else "of at most"
            found = "nothing" if pd.isna(cells[name][line]) else cells[name][line]
            text = f"{path}: line {line + 2}, column '{name}': must be a number {what} {most:g}, found {found}"
            raise InputError(text, "value", name)
    table = {name: np.full(len(numbers), value) for name, value in defaults.items()}
    return table | {name: column.to_numpy() for name, column in numbers.items()}
