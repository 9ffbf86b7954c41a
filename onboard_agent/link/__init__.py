"""Sign-in and the link to the tower. No I/O except for enrolment and the identity file."""
