"""One muscle composed of all laws; owner of parameter row and state layout."""
