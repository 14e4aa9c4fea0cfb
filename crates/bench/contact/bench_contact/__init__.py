"""Contact solvers side by side: time to a tolerance on public and own problems, judged by one program."""
