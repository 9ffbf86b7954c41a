"""The links: agents, browsers, the UDP endpoint, and the way of a frame between them."""
