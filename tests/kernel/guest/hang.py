"""hang.py THREAD: stops one thread of a process, and only that, for good: its process goes on without it."""
import ctypes
import sys
import time

PTRACE_SEIZE, PTRACE_INTERRUPT = 0x4206, 0x4207
ptrace = ctypes.CDLL(None, use_errno=True).ptrace
ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
thread = int(sys.argv[1])
for request in (PTRACE_SEIZE, PTRACE_INTERRUPT):
    if ptrace(request, thread, None, None) != 0:
        sys.exit(f"hang: ptrace: error {ctypes.get_errno()}")
time.sleep(120)
