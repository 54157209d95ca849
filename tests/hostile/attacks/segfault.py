# title: A real segmentation fault
# told: killed by SIGSEGV

import ctypes

ctypes.string_at(0)
