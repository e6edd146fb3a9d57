"""Columns of the logs of a study that hold something else than their names say: told before anything is searched."""

from collections.abc import Iterator
from pathlib import Path

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.logs import log_files
from bayesub.logs.finding import Finding
from bayesub.model.prescribed import STATES
from bayesub.report import log_card
from bayesub.sensors import QUANTITIES
from bayesub.study.run.prepare import Setup
from bayesub.study.run.run_folder import TimedProgress


def refuse_misread(setup: Setup, progress: TimedProgress) -> None:
    """Say what contradicts what in the logs of a study, of the columns that it uses.

    Raises
    ------
    InputError
        If a column holds something else than its name says, and the trial does not say ``trust_log``.
    """
    for path, is_trusted, findings in _logs(setup):
        misread = [finding for finding in findings if finding.misread]
        if misread and not is_trusted:
            others = f" ({len(misread) - 1} more: bayesub check {path})" if len(misread) > 1 else ""
            raise InputError(
                f"{path}: {misread[0].line()}{others}; if the log is right all the same, give trust_log = true",
                "data",
                ", ".join(misread[0].columns),
            )
        for finding in findings:
            progress.remark(f"{path}: {finding.line()}")


def _logs(setup) -> Iterator[tuple[Path, bool, list[Finding]]]:
    """Each log, whether it is trusted, and what is wrong with the columns that are used."""
    study, fins = setup.study, setup.vehicle.actuators.log_columns
    trials = [(section, setup.trials[name].record) for name, section, _ in study.each_trial()]
    unseen = {trial.name: trial.problem.record for trial in setup.unseen}
    trials += [(section, unseen[section.name]) for section, _ in study.each_check()]
    for section, record in trials:
        if section.data is None:
            continue
        path = toml_files.find_log(study.path(section.data))
        log = log_files.read_log(path, fins, ascending=False)
        headers = [header for header in log_files.headers(path, fins) if header not in (section.ignore or ())]
        names = {header: log_files.short_name(header) for header in headers}
        log = {name: log[name] for name in ("time", *names.values()) if name in log}
        read = {channel.quantity for channel in record.channels} | {STATES[a][0] for a in section.prescribed or ()}
        unused = {header for header, name in names.items() if name in QUANTITIES and name not in read}
        findings = log_card.check(log, headers, fins, setup.vehicle).findings
        yield path, bool(section.trust_log), [one for one in findings if not unused.issuperset(one.columns)]
