"""Files of catseye's exporters, read by the formats' own public readers.

The samples and `expected.json`, which says what is in them, are written by the Rust test
`samples::written_for_the_public_readers` of catseye-export into the folder that the environment variable
`CATSEYE_SAMPLES` names.
"""

import json
import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def samples():
    folder = os.environ.get("CATSEYE_SAMPLES")
    if not folder:
        pytest.fail("CATSEYE_SAMPLES does not name the folder of the samples (see conftest.py)")
    folder = Path(folder)
    assert (folder / "expected.json").is_file(), f"{folder} holds no samples"
    return folder


@pytest.fixture(scope="session")
def expected(samples):
    """Sweeps in the order in which they were written."""
    sweeps = json.loads((samples / "expected.json").read_text())
    assert len(sweeps) == 4
    return sweeps
