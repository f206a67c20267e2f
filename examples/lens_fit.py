# SPDX-License-Identifier: Apache-2.0
"""The lens of a device, of up to 14 coefficients, as one of the estimator's, of four: what bridges of cameras share. Needs numpy."""
import numpy

WORST_FIT_PX = 0.5  # root mean square


def device_pixels(k, rays):
    """Pixels of rays (x, y on the plane z = 1) in units of the focal length, by the rational model of 14 coefficients."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = (list(k) + [0.0] * 14)[:12]
    x, y = rays[:, 0], rays[:, 1]
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return numpy.stack([x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + s1 * r2 + s2 * r2 * r2,
                        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + s3 * r2 + s4 * r2 * r2], axis=1)


def equidistant_pixels(lens, rays):
    """lens: fx, fy, cx, cy, k1 to k4."""
    r = numpy.maximum(numpy.hypot(rays[:, 0], rays[:, 1]), 1e-12)
    a = numpy.arctan(r)
    bent = a * (1 + a**2 * (lens[4] + a**2 * (lens[5] + a**2 * (lens[6] + a**2 * lens[7])))) / r
    return lens[:2] * (rays * bent[:, None]) + lens[2:4]


def rays_in_view(K, k, width, height):
    """Rays of a grid that the device's model maps into the image, where it is one to one, and their pixels."""
    u = numpy.linspace(-2, 2, 161)
    rays = numpy.stack(numpy.meshgrid(u, u), axis=2).reshape(-1, 2)
    outwards = numpy.stack([(device_pixels(k, share * rays) * rays).sum(axis=1) for share in numpy.linspace(0, 1, 41)])
    grows = (numpy.diff(outwards, axis=0) >= 0).all(axis=0)
    bent = device_pixels(k, rays)
    pixels = bent * (K[0, 0], K[1, 1]) + (K[0, 2], K[1, 2])
    inside = grows & (pixels >= 0).all(axis=1) & (pixels[:, 0] < width) & (pixels[:, 1] < height)
    return rays[inside], pixels[inside]


def fitted_equidistant(K, k, width, height):
    """The equidistant lens next to the device's rational model, which the socket does not carry: (lens, error in px)."""
    rays, pixels = rays_in_view(K, k, width, height)
    lens = numpy.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], 0, 0, 0, 0], float)
    for _ in range(20):
        error = (equidistant_pixels(lens, rays) - pixels).ravel()
        steps = numpy.diag([1e-3] * 4 + [1e-6] * 4)
        J = numpy.stack([(equidistant_pixels(lens + d, rays) - pixels).ravel() - error for d in steps], axis=1) / numpy.diag(steps)
        lens = lens - numpy.linalg.lstsq(J, error, rcond=None)[0]
    error = equidistant_pixels(lens, rays) - pixels
    return lens, float(numpy.sqrt((error**2).sum(axis=1).mean()))
