"""`python -m mjcartpole`."""

from mjcartpole.cli import main

if __name__ == "__main__":
    main()
