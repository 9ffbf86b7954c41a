"""Who flies: leases, what a frame may do, holds, loss checks, safety settings."""
