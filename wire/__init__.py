"""What crosses the network, with no I/O in it. Imports nothing of ours; everyone may import it."""
