"""Do the counts and persistences of an instance hold? Events counted, values remembered, and the look back at them."""
