"""What do the user's texts say, and do they fit the pipeline? Chronicles, monitors, linkage, tables of CSV and TOML."""
