"""When did a relation change? Thresholds with hysteresis over what was measured."""
