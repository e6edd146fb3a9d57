import pytest

import bayesub as bs


@pytest.fixture(scope="session")
def boat(suboff):
    return suboff


@pytest.fixture(scope="session")
def manoeuvre(boat):
    return bs.load_manoeuvre("coupled", boat)
