"""From the text of interfaces to a shared library: sources, compilers, and a cache of builds."""
