"""Hostile inputs of the editor: requests, sockets, other accounts, web pages and long use."""
