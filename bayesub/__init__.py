"""bayesub: which hydrodynamic coefficients of a submarine do free-swimming trials determine, how well, and why not the
others?

Public names in the order of the data flow: a vehicle and a manoeuvre give a trajectory, sensors make it a record, the
record and a prior make a problem, and the problem goes to baselines, identifiability and sampling.
"""

from bayesub import baselines, coefficients, identifiability, likelihoods, priors, sensors
from bayesub.coefficients import regressors
from bayesub.errors import InputError
from bayesub.manoeuvres import Manoeuvre, load_manoeuvre, random_manoeuvre
from bayesub.problem import Problem
from bayesub.report import write_report
from bayesub.sampling import CrossCheck, Posterior, cross_check, sample
from bayesub.sensors import Record, observe
from bayesub.simulate import Trajectory, accelerations, simulate
from bayesub.vehicles import Vehicle, load_vehicle

__version__ = "0.1.0"

__all__ = [
    "CrossCheck",
    "InputError",
    "Manoeuvre",
    "Posterior",
    "Problem",
    "Record",
    "Trajectory",
    "Vehicle",
    "accelerations",
    "baselines",
    "coefficients",
    "cross_check",
    "identifiability",
    "likelihoods",
    "load_manoeuvre",
    "load_vehicle",
    "observe",
    "priors",
    "random_manoeuvre",
    "regressors",
    "sample",
    "sensors",
    "simulate",
    "write_report",
]
