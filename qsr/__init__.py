"""How do cars and places stand to each other, and when did that change? Qualitative relations as change events."""
