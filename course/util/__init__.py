"""What every package needs: files written whole, checked arguments, and what the machine offers."""
