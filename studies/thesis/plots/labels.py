"""Labels of the coefficients that the thesis is about."""

from functools import partial

from bayesub.model.coefficients import EQUATIONS
from bayesub.report.plots import coefficients

labels = partial(coefficients.labels, equations=EQUATIONS)
starred = partial(coefficients.star, equations=EQUATIONS)
