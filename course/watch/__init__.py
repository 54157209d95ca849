"""What live views are made of: plain models that watch a session, without a widget in them."""
