"""Places, and the messages that tell them: `messages` is the door."""
