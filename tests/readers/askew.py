"""Prints measurements of a metal whose scratches are turned by 30 degrees against the tangent and whose facets lean across them,
so that neither a mirror nor half a turn leaves it as it is: the highlight of GGX, stretched and moved."""

import math

ALPHAS, TURN = (0.2, 0.5), math.radians(30)


def direction(theta, phi):
    theta, phi = math.radians(theta), math.radians(phi) - TURN
    return math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)


def brdf(light, view):
    x, y, z = (a + b for a, b in zip(light, view))
    x += 0.15 * z
    across = ((x / ALPHAS[0]) ** 2 + (y / ALPHAS[1]) ** 2 + z**2) / (x * x + y * y + z * z)
    masked = lambda v: math.hypot(ALPHAS[0] * v[0], ALPHAS[1] * v[1], v[2])
    d = 1 / (math.pi * ALPHAS[0] * ALPHAS[1] * across**2)
    return d * 0.5 / (light[2] * masked(view) + view[2] * masked(light))


angles = [(theta, phi) for theta in range(0, 90, 15) for phi in (range(0, 360, 30) if theta else [0])]
print("theta_i,phi_i,theta_o,phi_o,r,g,b")
for light in angles:
    for view in angles:
        value = brdf(direction(*light), direction(*view))
        print(*light, *view, *(f"{colour * value:.5g}" for colour in (0.9, 0.7, 0.5)), sep=",")
