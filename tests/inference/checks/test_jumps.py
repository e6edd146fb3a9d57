"""Jumps of a log likelihood: found where there are any, as high as they are, and lower with shorter steps."""

from dataclasses import dataclass

import numpy as np
import pytest

from bayesub.inference.checks.jumps import largest_jump, sentence
from thesis import sampler_cost


@dataclass
class Stairs:
    """A log likelihood that is smooth, but for stairs along the first parameter."""

    height: float
    width: float = 0.5

    def log_likelihood(self, parameters):
        bent = parameters[:, 1] - 0.1 * parameters[:, 0] ** 2
        return -0.5 * bent**2 + self.height * np.floor(parameters[:, 0] / self.width)


@pytest.fixture
def draws():
    return np.random.default_rng(0).standard_normal((500, 2))


@pytest.mark.parametrize("height", [0.5, 5.0, 50.0])
def test_a_jump_is_as_high_as_it_is(draws, height):
    """Less what a cubic makes of it, and where a piece has one jump only."""
    found = largest_jump(Stairs(height), draws, np.random.default_rng(1))
    assert 0.6 * height < found < 1.2 * height


def test_a_smooth_density_has_none(draws):
    """Negative control: the bent one without stairs."""
    assert largest_jump(Stairs(0.0), draws, np.random.default_rng(1)) < 1e-4


def test_what_is_not_finite_is_left_out(draws):
    """Places where simulations fail are no jumps."""

    class Cliff(Stairs):
        def log_likelihood(self, parameters):
            return np.where(parameters[:, 0] > 1.0, -np.inf, super().log_likelihood(parameters))

    assert largest_jump(Cliff(0.0), draws, np.random.default_rng(1)) < 1e-4
    assert largest_jump(Cliff(5.0), draws, np.random.default_rng(1)) > 3.0


def test_jumps_are_lower_with_shorter_steps(monkeypatch):
    """Of a force with sg(w), in the normal approximation of a posterior that rounded and precise readings make."""
    found = []
    for finer in (1.0, 8.0):
        monkeypatch.setattr(sampler_cost, "FINER", finer)
        problem = sampler_cost.pose("auv690", "coupled", "rounded")
        jacobian = problem.jacobian(problem.reference) * problem.prior.sd
        covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(problem.n_params))
        rng = np.random.default_rng(0)
        steps = rng.multivariate_normal(np.zeros(problem.n_params), covariance, 500, method="cholesky")
        found.append(largest_jump(problem, problem.reference + 0.3 * steps * problem.prior.sd, rng))
    assert found[0] > 3.0
    assert found[1] < 0.5 * found[0]


@pytest.mark.parametrize(
    ("jump", "said"), [(0.5, None), (1.0, "dt_s = 0.2 "), (3.0, "dt_s = 0.05 "), (9.0, "dt_s = 0.02 ")]
)
def test_what_to_try(jump, said):
    """The next shorter of the usual steps with which jumps are not noticed; of little ones nothing is said."""
    text = sentence(jump, 0.2)
    assert said in text if said else not text
