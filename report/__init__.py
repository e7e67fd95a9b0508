"""Markdown and pictures from results; reads nothing else."""
