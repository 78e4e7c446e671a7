"""`python -m stepload` is the `stepload` command."""

from stepload.cli.main import main

main()
