// Sine, cosine and arc tangent as polynomials: a device's own may be inaccurate. The twin of angles.rs.

const ANGLES_PI = 3.14159265;

// Cosine and sine of an angle in turns, -1 to 1.
fn angles_circle(turn: f32) -> vec2f {
    let quarters = floor(4.0 * turn + 0.5);
    let x = (turn - 0.25 * quarters) * (2.0 * ANGLES_PI);
    let z = x * x;
    let sine = x + x * z * (-1.6666655e-1 + z * (8.332161e-3 - z * 1.9515296e-4));
    let cosine = 1.0 - 0.5 * z + z * z * (4.1666646e-2 + z * (-1.3887316e-3 + z * 2.4433158e-5));
    switch i32(quarters) & 3 {
        case 0: {
            return vec2f(cosine, sine);
        }
        case 1: {
            return vec2f(-sine, cosine);
        }
        case 2: {
            return vec2f(-cosine, -sine);
        }
        default: {
            return vec2f(sine, -cosine);
        }
    }
}

// The angle of (x, y) from the x axis, -pi to pi; 0 for (0, 0).
fn angles_angle(y: f32, x: f32) -> f32 {
    let low = min(abs(x), abs(y));
    let high = max(abs(x), abs(y));
    if high == 0.0 {
        return 0.0;
    }
    // Above pi / 8 the polynomial gives the difference from pi / 4.
    let is_far = low > 0.41421356 * high;
    let t = select(low, low - high, is_far) / select(high, low + high, is_far);
    let z = t * t;
    let series = -3.333295e-1 + z * (1.997771e-1 + z * (-1.3877686e-1 + z * 8.053745e-2));
    let small = t + t * z * series + select(0.0, 0.25 * ANGLES_PI, is_far);
    let right = select(small, 0.5 * ANGLES_PI - small, abs(y) > abs(x));
    let upper = select(right, ANGLES_PI - right, x < 0.0);
    return select(upper, -upper, y < 0.0);
}
