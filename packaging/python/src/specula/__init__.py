"""The program specula; run `specula --help`."""
