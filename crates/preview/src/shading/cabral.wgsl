// Cabral's twelve maps (Cabral, Olano and Nemec 1999; [RH02, app. C]): the three maps around the view, each
// looked up bilinearly, are blended with the view's weights in their triangle. The twin of cabral.rs; the
// vertices and triangles are those of `shrm::icosahedron`.

const CABRAL_POINTS = array<vec3f, 12>(
    vec3f(0.0, 0.0, 1.0),
    vec3f(0.89442719, 0.0, 0.4472136),
    vec3f(0.2763932, 0.85065081, 0.4472136),
    vec3f(-0.7236068, 0.52573111, 0.4472136),
    vec3f(-0.7236068, -0.52573111, 0.4472136),
    vec3f(0.2763932, -0.85065081, 0.4472136),
    vec3f(0.7236068, 0.52573111, -0.4472136),
    vec3f(-0.2763932, 0.85065081, -0.4472136),
    vec3f(-0.89442719, 0.0, -0.4472136),
    vec3f(-0.2763932, -0.85065081, -0.4472136),
    vec3f(0.7236068, -0.52573111, -0.4472136),
    vec3f(0.0, 0.0, -1.0),
);

const CABRAL_TRIANGLES = array<vec3u, 20>(
    vec3u(0, 1, 2), vec3u(0, 2, 3), vec3u(0, 3, 4), vec3u(0, 4, 5), vec3u(0, 5, 1),
    vec3u(1, 6, 2), vec3u(2, 7, 3), vec3u(3, 8, 4), vec3u(4, 9, 5), vec3u(5, 10, 1),
    vec3u(6, 7, 2), vec3u(7, 8, 3), vec3u(8, 9, 4), vec3u(9, 10, 5), vec3u(10, 6, 1),
    vec3u(11, 7, 6), vec3u(11, 8, 7), vec3u(11, 9, 8), vec3u(11, 10, 9), vec3u(11, 6, 10),
);

// A vertex's map is in the layers 6 vertex + face from the first on.
fn cabral(surface: Surface, part: MapPart) -> vec3f {
    var points = CABRAL_POINTS;
    var triangles = CABRAL_TRIANGLES;
    let v = surface.view;
    // A view lies in the triangle whose centre is nearest.
    var vertices = vec3u(0);
    var most = -4.0;
    for (var triangle = 0u; triangle < 20u; triangle++) {
        let corners = triangles[triangle];
        let middle = dot(points[corners.x], v) + dot(points[corners.y], v) + dot(points[corners.z], v);
        if middle > most {
            vertices = corners;
            most = middle;
        }
    }
    let a = points[vertices.x];
    let b = points[vertices.y];
    let c = points[vertices.z];
    let volumes = max(vec3f(dot(v, cross(b, c)), dot(v, cross(c, a)), dot(v, cross(a, b))), vec3f(0.0));
    let shares = volumes / (volumes.x + volumes.y + volumes.z);
    let taps = cube_taps(part.edge, surface_central(surface, part.centre));
    return cube_blend(map, taps, part.first + 6u * vertices.x) * shares.x
        + cube_blend(map, taps, part.first + 6u * vertices.y) * shares.y
        + cube_blend(map, taps, part.first + 6u * vertices.z) * shares.z;
}
