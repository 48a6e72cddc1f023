"""The browser editor: state in `model`, pictures from `render`, solutions from `design`."""
