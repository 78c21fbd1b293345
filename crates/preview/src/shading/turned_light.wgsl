// A light turned from the coordinates of a mesh into the frame of a point. The twin of turned_light.rs, which
// explains how.
//
// It needs the buffer quarter_turns, for each band from degree 1 on the entries [2 l + 1, l / 2 + 1] of the
// turns about x by 90 degrees and by -90.

// The entries of the widest band, of degree 14.
const TURNED_WIDTH = 29u;

// Cosine and sine of the angles of R_z(alpha) R_y(beta) R_z(gamma).
struct TurnedAngles {
    alpha: vec2f,
    beta: vec2f,
    gamma: vec2f,
}

// The axes x, y and N of the frame at a point, from a tangent and a normal of any length.
fn frame_at(tangent: vec3f, normal: vec3f) -> mat3x3f {
    let length_of_normal = length(normal);
    let n = select(vec3f(0.0, 0.0, 1.0), normal / length_of_normal, length_of_normal > 0.0);
    let across = cross(n, tangent);
    let length_across = length(across);
    // A tangent along the normal says nothing: any vector across the normal will do.
    let helper = select(vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0), abs(n.z) > 0.9);
    let y = select(normalize(cross(n, helper)), across / length_across, length_across > 0.0);
    return mat3x3f(cross(y, n), y, n);
}

// The angles of a frame.
fn turned_angles(frame: mat3x3f) -> TurnedAngles {
    let x = frame[0];
    let n = frame[2];
    let sine = length(n.xy);
    let alpha = select(vec2f(1.0, 0.0), n.xy / sine, sine > 0.0);
    let along = dot(alpha, x.xy);
    let gamma = vec2f(n.z * along - sine * x.z, alpha.x * x.y - alpha.y * x.x);
    return TurnedAngles(alpha, vec2f(n.z, sine), gamma);
}

// The entries of the turns of a band.
fn turned_entries(l: u32) -> u32 {
    return (2u * l + 1u) * (l / 2u + 1u);
}

// The column of the k-th entry that is not zero in a row of the turns about x; beyond the last if there are
// fewer.
fn quarter_turn_column(l: u32, row: u32, k: u32) -> u32 {
    let odd = (l + select(0u, 1u, row < l)) % 2u;
    let is_even = row % 2u == 0u;
    let m = select(2u - odd, odd, is_even) + 2u * k;
    if m > l {
        return 2u * l + 1u;
    }
    return select(l - m, l + m, is_even);
}

fn turn_about_z(l: u32, angle: vec2f, band: ptr<function, array<vec3f, TURNED_WIDTH>>) {
    var multiple = vec2f(1.0, 0.0);
    for (var m = 1u; m <= l; m++) {
        multiple = vec2f(
            multiple.x * angle.x + multiple.y * angle.y,
            multiple.y * angle.x - multiple.x * angle.y,
        );
        let even = (*band)[l + m];
        let odd = (*band)[l - m];
        (*band)[l + m] = even * multiple.x - odd * multiple.y;
        (*band)[l - m] = even * multiple.y + odd * multiple.x;
    }
}

fn turn_about_x(l: u32, entry: u32, back: u32, band: ptr<function, array<vec3f, TURNED_WIDTH>>) {
    let count = l / 2u + 1u;
    let before = *band;
    for (var row = 0u; row <= 2u * l; row++) {
        var sum = vec3f(0.0);
        for (var k = 0u; k < count; k++) {
            let column = quarter_turn_column(l, row, k);
            if column <= 2u * l {
                sum += quarter_turns[entry + row * count + k][back] * before[column];
            }
        }
        (*band)[row] = sum;
    }
}

// Turns the coefficients of degree l of a light, RGB, into the frame; `entry` is the first of the band's turns.
fn turn_band(l: u32, entry: u32, angles: TurnedAngles, band: ptr<function, array<vec3f, TURNED_WIDTH>>) {
    turn_about_z(l, angles.alpha, band);
    turn_about_x(l, entry, 0u, band);
    turn_about_z(l, angles.beta, band);
    turn_about_x(l, entry, 1u, band);
    turn_about_z(l, angles.gamma, band);
}
