"""`python -m stepload` is the `stepload` command."""

from stepload.cli.main import main

if __name__ == "__main__":  # a process of the page's server loads it too
    main()
