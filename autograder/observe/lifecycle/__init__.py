"""Lives and states of a node, and what its process keeps of them."""
