"""What every room needs: files written whole, checked arguments, and what the machine offers."""
