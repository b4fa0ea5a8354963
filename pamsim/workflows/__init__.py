"""What a user calls: the rooms below, joined into one job."""
