"""The wire formats of the product, without I/O. Imports no other package of the product; all of them may import it."""
