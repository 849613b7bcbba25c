"""Axes of no pyplot, and one run of the lesson's experiment."""

import sys
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


@pytest.fixture(autouse=True)
def no_figure_left_open():
    """No plotter may leave a figure in pyplot's hands, if anybody imported it at all."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        assert sys.modules["matplotlib.pyplot"].get_fignums() == []
