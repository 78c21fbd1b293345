// Real spherical harmonics of any degree as polynomials of a direction (x, y, z). The twin of harmonics.rs,
// which explains the recurrence Q_qq = k_q, Q_pq = a_pq z Q_p-1,q - b_pq Q_p-2,q.

// [a_pq, b_pq] at p (p + 1) / 2 + q; [k_q, 0] where p = q. `Harmonics::constants`.
@group(0) @binding(3) var<storage, read> harmonics_constants: array<vec2f>;

// The number of rows up to a degree.
fn harmonics_rows(degree: u32) -> u32 {
    return (degree + 1u) * (degree + 1u);
}

fn harmonics_constant(p: u32, q: u32) -> vec2f {
    return harmonics_constants[p * (p + 1u) / 2u + q];
}
