"""Which scenario has overtakes on parallel lanes? A motorway of three lanes each way."""
