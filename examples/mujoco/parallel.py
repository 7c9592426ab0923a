"""Many runs at a time, with their count on stderr."""

import concurrent.futures
import sys


def results_of(run, tasks, jobs):
    """`run(task)` of every task, in order, `jobs` at a time (None: one per core)."""
    results = []
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        for result in pool.map(run, tasks):
            results.append(result)
            print(f"\r{len(results)} of {len(tasks)} runs", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return results
