"""How are rows kept of which there are thousands in a minute? Ten seconds of one kind together, column by column."""
