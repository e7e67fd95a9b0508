"""Many load cases on one assembly: opened once, prepared once, solved one after another, each vouched for."""
