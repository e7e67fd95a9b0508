"""Ladders: each file makes problems harder in one way, step by step."""
