"""Many runs: jobs over processes or machines, and their rows on disk."""
