// Kautz and McCool's texture (2000; [RH02, app. C]): a reflection map for each of several evenly spaced
// angles between the central direction and the view, 0 to pi. Look-ups are bilinear in a slice and linear
// between two. The twin of kautz_mccool.rs. It needs angles.wgsl.

// A slice's map is in the layers 6 slice + face from the first on.
fn kautz_mccool(surface: Surface, part: MapPart) -> vec3f {
    let central = surface_central(surface, part.centre);
    let angle = angles_angle(length(cross(central, surface.view)), dot(central, surface.view));
    let last = part.slices - 1u;
    let position = angle / ANGLES_PI * f32(last);
    let low = min(u32(position), last);
    let high = min(low + 1u, last);
    let share = position - f32(low);
    let taps = cube_taps(part.edge, central);
    let a = cube_blend(map, taps, part.first + 6u * low);
    let b = cube_blend(map, taps, part.first + 6u * high);
    return a + (b - a) * share;
}
