"""`python -m stepload_verify.emulators …`: the same as `stepload emulate …`."""

from __future__ import annotations

import sys

from stepload.errors import SteploadError
from stepload_verify.emulators.command import app

if __name__ == "__main__":
    try:
        app()
    except SteploadError as error:
        sys.exit(f"error: {error}")
