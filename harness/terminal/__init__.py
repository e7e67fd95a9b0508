"""What the terminal shows: messages, progress, exit codes."""
