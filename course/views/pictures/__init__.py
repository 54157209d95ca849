"""What views show as SVG documents: for notebooks that are read without a kernel."""
