"""One local page in a browser: runs, reports, curves, the live run, preflight of a plan."""
