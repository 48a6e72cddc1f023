"""`python -m flarewright` is the command `flarewright`, for where scripts are not on the path."""

from flarewright.cli.app import main

if __name__ == "__main__":
    main()
