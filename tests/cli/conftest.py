"""What the tests of the command line share: running it, and small inputs."""

import numpy as np
import pytest

from labkit.cli import main
from labkit.simulation import Lidar, room, scan_along


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """Run the command line in an empty folder; its status, output and error output."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        try:
            status = main([str(argument) for argument in arguments])
        except SystemExit as leaving:  # argparse: usage and --help
            status = leaving.code
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


@pytest.fixture(scope="session")
def carmen_log(tmp_path_factory):
    """A CARMEN log of eight scans in a room, with exact odometry, and the path driven."""
    steps = np.arange(8)
    path = np.column_stack([0.1 * steps - 0.4, 0.02 * steps, 0.03 * steps])
    lidar = Lidar(beam_count=181, field_of_view=np.pi, noise_std=0.005, range_max=30.0)
    lines = []
    for k, scan in enumerate(scan_along(room(), path, lidar, rng=3)):
        ranges = " ".join(f"{r:.4f}" for r in np.where(np.isinf(scan.ranges), 81.83, scan.ranges))
        pose = " ".join(f"{value:.6f}" for value in path[k])
        lines.append(f"FLASER 181 {ranges} {pose} {pose} {k}.5 robot {k}.5")
    file = tmp_path_factory.mktemp("log") / "room.log"
    file.write_text("\n".join(lines) + "\n")
    return file, path
