"""What several test modules share."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest

from clarke_gym.representations import representation_names


@pytest.fixture(scope="session")
def representations_for():
    """Return the representations that exist for n tendons."""

    def names(n):
        return [name for name in representation_names() if n == 4 or name != "antagonistic"]

    return names
