// Traced shadows: whether the mesh of an object hides a direction from a point on it. The twin of shadows.rs,
// with the same triangles in a tree without a stack: `transfer::OccluderNode`.
//
// It needs surface.wgsl.

struct ShadowUniforms {
    // From the light's frame to the mesh's coordinates.
    to_mesh: mat3x3f,
    nodes: u32,
}

// Two for each node: the least coordinates of its box, and the next node outside it; the greatest, and the
// first of its triangles times 256 plus their number. Then three for each triangle: its corners.
@group(3) @binding(4) var<storage, read> shadow_tree: array<vec4u>;
@group(3) @binding(5) var<uniform> shadows: ShadowUniforms;

// How far beyond a triangle's edges a ray still hits it, as a share of the triangle.
const SHADOWS_WIDER = 1e-5;

// How far rays start above a point, in roundings of the numbers there, and how much farther a point may be
// from the plane of a triangle that it lies on: see occluders.rs.
const SHADOWS_ROUNDINGS = 8.0;
const SHADOWS_ON = 4.0;

// How far below a triangle a position may be that a device has interpolated, as a share of the triangle's
// longest edge: its rounding grows with the picture's size over the triangle's. The CPU's has none of this.
const SHADOWS_BELOW = 1.2e-4;

// Where rays start, in the mesh's coordinates, and the normal there, in the light's frame.
var<private> shadows_origin: vec3f;
var<private> shadows_up: vec3f;

// Sets the point at which light arrives, at a position in the mesh's coordinates, and returns its surface.
fn shadows_at(surface: Surface, position: vec3f) -> Surface {
    let normal = surface_unit_or(shadows.to_mesh * surface.normal, vec3f(0.0));
    shadows_origin = position + normal * shadows_above(position, normal);
    shadows_up = surface.normal;
    return surface;
}

// How far above a point rays start: of the size of its coordinates, and of the triangles that it lies on; more
// if it is below one of them.
fn shadows_above(position: vec3f, normal: vec3f) -> f32 {
    let place = abs(position);
    let number = max(place.x, max(place.y, place.z));
    let slack = SHADOWS_ON * shadows_clearance(number, 0.0);
    var size = 0.0;
    var below = 0.0;
    var node = 0u;
    while node < shadows.nodes {
        let low = shadow_tree[2u * node];
        let high = shadow_tree[2u * node + 1u];
        let least = bitcast<vec3f>(low.xyz);
        let most = bitcast<vec3f>(high.xyz);
        let outside = max(least - position, position - most);
        if max(outside.x, max(outside.y, outside.z)) > slack + SHADOWS_BELOW * length(most - least) {
            node = low.w;
            continue;
        }
        for (var k = 0u; k < (high.w & 255u); k++) {
            let triangle = 2u * shadows.nodes + 3u * ((high.w >> 8u) + k);
            let corner = bitcast<vec3f>(shadow_tree[triangle].xyz);
            let along = bitcast<vec3f>(shadow_tree[triangle + 1u].xyz) - corner;
            let across = bitcast<vec3f>(shadow_tree[triangle + 2u].xyz) - corner;
            let own = max(length(along), max(length(across), length(across - along)));
            let upward = cross(along, across);
            let facing = select(-1.0, 1.0, dot(upward, normal) >= 0.0);
            let height = facing * dot(position - corner, upward) / length(upward);
            let on = SHADOWS_ON * shadows_clearance(number, own);
            if abs(height) <= on {
                size = max(size, own);
            }
            if -height <= on + SHADOWS_BELOW * own {
                below = max(below, -height);
            }
        }
        node += 1u;
    }
    return shadows_clearance(number, size) + below;
}

fn shadows_clearance(number: f32, size: f32) -> f32 {
    return SHADOWS_ROUNDINGS * 5.9604645e-8 * (number + size);
}

// Light from below the point's own horizon is not shadowed.
fn light_arrives(direction: vec3f) -> bool {
    if dot(direction, shadows_up) <= 0.0 {
        return true;
    }
    let ray = shadows.to_mesh * direction;
    let inverse = 1.0 / select(ray, vec3f(1e-20), abs(ray) < vec3f(1e-20));
    var node = 0u;
    while node < shadows.nodes {
        let low = shadow_tree[2u * node];
        let high = shadow_tree[2u * node + 1u];
        let a = (bitcast<vec3f>(low.xyz) - shadows_origin) * inverse;
        let b = (bitcast<vec3f>(high.xyz) - shadows_origin) * inverse;
        let near = min(a, b);
        let far = max(a, b);
        let enter = max(max(near.x, near.y), max(near.z, 0.0));
        // Rounding must not let a ray pass beside a flat box.
        if enter > 1.00001 * min(far.x, min(far.y, far.z)) {
            node = low.w;
            continue;
        }
        let count = high.w & 255u;
        for (var k = 0u; k < count; k++) {
            if shadows_hit(ray, 2u * shadows.nodes + 3u * ((high.w >> 8u) + k)) {
                return false;
            }
        }
        node += 1u;
    }
    return true;
}

// Whether a ray hits a triangle, from either side (Möller and Trumbore 1997).
fn shadows_hit(ray: vec3f, triangle: u32) -> bool {
    let corner = bitcast<vec3f>(shadow_tree[triangle].xyz);
    let along = bitcast<vec3f>(shadow_tree[triangle + 1u].xyz) - corner;
    let across = bitcast<vec3f>(shadow_tree[triangle + 2u].xyz) - corner;
    let p = cross(ray, across);
    let volume = dot(along, p);
    // A ray in the triangle's plane hits nothing.
    if volume == 0.0 {
        return false;
    }
    let offset = shadows_origin - corner;
    let u = dot(offset, p) / volume;
    let q = cross(offset, along);
    let v = dot(ray, q) / volume;
    return u >= -SHADOWS_WIDER && v >= -SHADOWS_WIDER && u + v <= 1.0 + SHADOWS_WIDER && dot(across, q) / volume >= 0.0;
}
