"""Imported flights on the disk, and the process that reads the files of strangers."""
