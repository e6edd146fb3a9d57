# isort: skip_file
from .io.errors import InputError
from .model import coefficients
from .model.coefficients import regressors
from .model.equations import EquationSet, load_equations
from .model.vehicles import Vehicle, load_vehicle
from .model.manoeuvres import Manoeuvre, load_manoeuvre, random_manoeuvre
from .model.disturbance import Disturbance
from .model.trajectory import Trajectory
from .model.simulate import accelerations, simulate
from .model.linear_form import linear_systems
from . import sensors
from .sensors import Record, observe
from .problem import likelihoods, priors
from .problem.disturbances import UnknownDisturbance
from .problem.problem import Problem
from .problem.own_model import DensityModel, LeastSquaresModel
from .problem.joint import JointProblem
from .inference import baselines, identifiability
from .findings.unseen import leave_one_out
from .inference.sampling import CrossCheck, Criteria, Posterior, cross_check, sample
from .report.report import write_report
from .study.after.export import export
from .study.run.result import StudyResult
from .study.run.run import run
from .study.schema.study_file import Study, load_study

__version__: str

__all__ = [
    "Criteria",
    "CrossCheck",
    "DensityModel",
    "Disturbance",
    "EquationSet",
    "InputError",
    "JointProblem",
    "LeastSquaresModel",
    "Manoeuvre",
    "Posterior",
    "Problem",
    "Record",
    "Study",
    "StudyResult",
    "Trajectory",
    "UnknownDisturbance",
    "Vehicle",
    "accelerations",
    "baselines",
    "coefficients",
    "cross_check",
    "export",
    "identifiability",
    "leave_one_out",
    "likelihoods",
    "linear_systems",
    "load_equations",
    "load_manoeuvre",
    "load_study",
    "load_vehicle",
    "observe",
    "priors",
    "random_manoeuvre",
    "regressors",
    "run",
    "sample",
    "sensors",
    "simulate",
    "write_report",
]
