"""What degraded pictures, times and poses do to the zero-flow map and to the servo, one by one."""
