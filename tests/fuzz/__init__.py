"""Hostile files: mutated small volumes of every format, of which nothing but documented errors may come."""
