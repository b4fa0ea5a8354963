"""Pictures, films and the interactive window of an arm."""
