"""One self-contained HTML page from the folders that ``evaluate`` and ``ablate`` write."""
