"""What temperature does to the bearings: the aluminium hub outgrows the steel shaft, and the preload falls."""

import thermospindle as ts

spindle = ts.load("hdd_2003")
for temperature in (20, 30, 40, 50, 60):
    upper = ts.point(spindle, temperature).state.bearing("upper")
    print(f"{temperature} C: preload {upper.preload:5.2f} N, contact angle {upper.contact_angle * 57.29578:5.2f} deg")
