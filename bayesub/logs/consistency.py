"""Which columns of a log disagree, and the change after which they agree."""

import numpy as np

from bayesub.logs import angles, clock, response, stuck
from bayesub.logs.finding import Finding
from bayesub.logs.log_files import CONTROLS, HEADERS
from bayesub.logs.mends import Mend, mends
from bayesub.logs.relations import Misfit, Relation, relations
from bayesub.logs.series import series

MAX_FINDINGS = 6
AGREES = 0.05  # share of the changes that differs, up to which nothing is looked for
EXPLAINED = 0.3  # share that a mend may leave
BETTER = 3.0  # factor by which a mend shrinks it
TIE = 1.1  # of two mends that do about the same the first is taken: radians (57) rather than minutes (60)
SIDEWAYS = 0.2  # speed ahead over that to the side, below which the names are exchanged
_FLOOR = 1e-3


def findings(log: dict[str, np.ndarray], headers: dict[str, str], controls: tuple[str, ...] = ()) -> list[Finding]:
    """All that disagrees in a log.

    Parameters
    ----------
    log : dict of str to ndarray of shape (n,)
        Short name -> values in SI units in the order of the file, ``time`` among them; not a number where there is no
        reading.
    headers : dict of str to str
        Short name -> header of the column in its file.
    controls : tuple of str
        Short names of controls besides those of all boats.
    """
    controls = (*CONTROLS, "rpm", *controls)
    log, result = clock.stamps(log)
    result += clock.jumps(log)
    data = series(log)
    for examine in (angles.findings, lambda data, headers: stuck.findings(data, headers, controls), _kinematics):
        data, of_one_kind = examine(data, headers)
        result += of_one_kind
    headers = _all(headers, data)
    result += _sideways(data, headers)
    return result + angles.controls(data, headers, controls) + response.findings(data, headers)


def _sideways(data, headers) -> list[Finding]:
    """Velocities through the water of a boat that goes by her side."""
    if "u" not in data or "v" not in data:
        return []
    u, v = (float(np.median(np.abs(data[name].values))) for name in "uv")
    if u >= SIDEWAYS * v:
        return []
    message = (
        f"{headers['u']} holds what {headers['v']} should: ahead {u:.3g} m/s and to the side {v:.3g} in the median"
    )
    return [Finding("name", (headers["u"], headers["v"]), message, "exchange the two names", misread=True)]


def _all(headers, data) -> dict[str, str]:
    """Headers of all columns, those that a mend has named among them."""
    return {name: headers.get(name, HEADERS.get(name, name)) for name in data} | headers


def _kinematics(data, headers):
    """The readings with columns that hold what their names say, and those that did not.

    Of all mends the one is taken that brings the relations together most, and the next is looked for in what it leaves.
    """
    memory, result = _Memory(), []
    for _ in range(MAX_FINDINGS):
        best = _best(data, _all(headers, data), memory)
        if best is None:
            break
        mend, message = best
        columns = tuple(_all(headers, data)[name] for name in mend.names)
        result.append(Finding(mend.kind, columns, message, mend.remedy, misread=True))
        data = mend.change(data)
    return data, result


class _Memory:
    """Misfits of relations, which are computed once for the same readings."""

    def __init__(self):
        self._misfits = {}

    def misfits(self, data) -> dict[str, tuple[Relation, tuple[Misfit, ...]]]:
        """Words of a relation -> relation and its misfits, of those that the columns allow."""
        result = {}
        for relation in relations(data):
            columns = tuple(data[name] for name in relation.columns(data))
            if not columns:
                continue
            key = relation.words, tuple(id(column) for column in columns)
            if key not in self._misfits:  # the columns stay alive with it, and so do their identities
                self._misfits[key] = relation.misfits(data), columns
            misfits, _ = self._misfits[key]
            if misfits:
                result[relation.words] = relation, misfits
        return result


def _best(data, headers, memory) -> tuple[Mend, str] | None:
    """The mend that brings the relations together most, and the words for it.

    Kinematics does not tell a track that is mirrored from a heading that is; what the boat does after her rudder does.
    """
    before, found = memory.misfits(data), []
    for mend in mends(data, headers):
        gain, evidence = _gain(before, memory.misfits(mend.change(data)))
        if gain > np.log(BETTER) * TIE and evidence is not None:
            found.append((gain, mend, evidence))
    if not found:
        return None
    most = max(gain for gain, *_ in found)
    equals = [(mend, evidence) for gain, mend, evidence in found if gain * TIE >= most]
    answered = (pair for pair in equals if not response.findings(pair[0].change(data), _all(headers, data)))
    mend, evidence = next(answered, equals[0])
    return mend, f"{mend.message}: {evidence}"


def _gain(before, after) -> tuple[float, str | None]:
    """By how much the logarithms of the shares fall together, and the relation that shows it best in words."""
    gain, largest, evidence = 0.0, 0.0, None
    gone = [misfits for words, (_, misfits) in before.items() if words not in after]
    gain += sum(_log(min(misfit.share for misfit in misfits)) for misfits in gone)
    for words, (relation, misfits) in after.items():
        old = before[words][1] if words in before else ()
        k = min(range(len(misfits)), key=lambda k: min(one[k].share for one in (misfits, old) if k < len(one)))
        share, was = misfits[k].share, old[k].share if k < len(old) else 1.0
        part = _log(was) - _log(share)
        gain += part
        if part > largest and was > AGREES and share < EXPLAINED:
            compared = old or next(iter(gone), ())
            largest, evidence = part, _words(relation, misfits[k], compared[k] if k < len(compared) else None)
    return gain, evidence


def _log(share) -> float:
    return float(np.log(min(1.0, max(_FLOOR, share))))


def _words(relation, misfit, as_named) -> str:
    factor, unit = (180.0 / np.pi, "deg/s") if relation.rotation else (1.0, "m/s")
    named = "" if as_named is None else f", as named by {factor * as_named.rms:.2g}"
    differ = f"differ by {factor * misfit.rms:.2g} {unit} so{named}"
    return f"{relation.words} {differ} (correlation {misfit.correlation:.4f})"
