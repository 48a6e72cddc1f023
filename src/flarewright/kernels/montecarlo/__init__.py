"""Monte Carlo rays of the reference renderer.

- `forward`: `trace_batch`, rays from a light through all orders of reflection; tallies
- `backward`: `trace_camera_batch`, rays from the sensor to area lights
- `radiance`: radiance of area lights along a ray
- `scattered_rays`: random single scattering of direct light; tallies
- `arguments`: records that these kernels take
- `philox`: counter-based random numbers
"""
