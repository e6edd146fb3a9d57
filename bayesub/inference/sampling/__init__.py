"""Posterior sampling: emcee in straightened coordinates, with proposals from a surrogate and exact acceptance.

Coordinates of the parameters, each a function of the one above it:

=========== ============================================== ================================ ===========================
coordinate  definition                                     prior in it                      made by
=========== ============================================== ================================ ===========================
parameters  coefficients (non-dimensional) and nuisance    as given                         the problem
            parameters (in the unit of their name)
t           the standard normal vector of the prior        N(0, I); bounds at infinity      ``Prior.standard``
x, scaled   as t, but linear in a uniform parameter, in    standard deviations of one;      ``Prior.scaled``
            prior standard deviations from its middle      a uniform one has walls at
                                                           plus and minus root three
z, whitened ``x = x_mode + basis z``, in which the         (of the prior times the          ``Geometry.scaled``
            Laplace approximation is N(0, I); stiffest     likelihood) N(0, I), if it is
            first                                          normal
y, straight ``z_B = q_B(z_after) + L_B y_B``: each decade  as z, if it is bent              ``Geometry.bent``
            of stiff coordinates from a polynomial in all
            that follow
=========== ============================================== ================================ ===========================

With histories of forces these are the coordinates of all other parameters, and those of the histories follow them
(:mod:`bayesub.inference.sampling.histories`).

Searches (:func:`bayesub.inference.baselines.gauss_newton`) work in t. The sampler works in y, and its log densities are
those in x, from which z and y differ by a constant.
"""

from bayesub.inference.sampling.nuts import CrossCheck, cross_check
from bayesub.inference.sampling.posterior import Criteria, Posterior
from bayesub.inference.sampling.sampler import sample, search_from

__all__ = ["Criteria", "CrossCheck", "Posterior", "cross_check", "sample", "search_from"]
