"""At which states does a formula fail for certain? Worked out anew where the history of its tests changed."""
