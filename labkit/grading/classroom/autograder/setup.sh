#!/usr/bin/env bash
# Runs once, when Gradescope builds the assignment's image (Ubuntu, as root).
set -euo pipefail
source=${AUTOGRADER:-/autograder}/source

export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -qq --yes --no-install-recommends python3 python3-venv bubblewrap libseccomp2 > /dev/null
python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "labkit needs Python 3.11: choose Ubuntu 24.04 or newer as the base image" >&2
    exit 1
}
python3 -m venv "$source/venv"
"$source/venv/bin/python" -m pip install --quiet --requirement "$source/requirements.txt"
# The list of fonts, in a folder that looks as if a box could write into it: matplotlib wants that.
install -d -m 1777 "$source/matplotlib"
MPLCONFIGDIR=$source/matplotlib "$source/venv/bin/python" -c 'import matplotlib.font_manager'
