"""Speed, as ratios or rates measured in one run; `python -m benchmarks` runs them all."""
