"""Axes of no pyplot, and one run of the lesson's experiment."""

from types import SimpleNamespace

import pytest

from labkit.icp import icp
from labkit.parameters import IcpParameters
from labkit.plotting import book_figure
from labkit.simulation import lesson_experiment


@pytest.fixture
def ax():
    return book_figure().subplots()


@pytest.fixture(scope="session")
def lesson():
    """The lesson's scans, guess and truth with ICP's parameters and result."""
    experiment = lesson_experiment()
    parameters = IcpParameters()
    result = icp(experiment.source, experiment.target, experiment.T_init, parameters)
    return SimpleNamespace(experiment=experiment, parameters=parameters, result=result)


@pytest.fixture
def labels():
    """A function that reads the legend of an axes."""
    return lambda ax: [text.get_text() for text in ax.get_legend().get_texts()]
