"""python -m rivetbench."""

from harness.__main__ import main

if __name__ == "__main__":
    main()
