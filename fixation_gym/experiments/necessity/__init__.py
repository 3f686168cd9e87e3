"""Whether obstacles must be seen: the best fixed blind way of every scenario."""
